#include "cdprcal/simulator/simulate_startup.hpp"

#include <algorithm>

#include "cdprcal/equilibria/wrench_distribution.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

/// Rows as they come, then a Log.
class Recorder {
 public:
  explicit Recorder(int cables) : n_(cables) {}

  /// False: not recorded, because a log's time increases and this sample's does not.
  bool add(const RobotSample& sample, const CableVector& setpoint_N) {
    const double last_s = samples_.empty() ? -HUGE_VAL : samples_.back().time_s;
    if (!std::isfinite(sample.time_s) || !(sample.time_s > last_s)) return false;
    samples_.push_back(sample);
    setpoints_.push_back(setpoint_N);
    return true;
  }

  [[nodiscard]] Log log(const std::string& source) const {
    const auto rows = static_cast<Eigen::Index>(samples_.size());
    Log log;
    log.source = source;
    log.time_s.resize(rows);
    for (LogMatrix* m : {&log.length_m, &log.swivel_rad, &log.tension_N, &log.tension_setpoint_N}) {
      m->resize(rows, n_);
    }
    log.roll_pitch_yaw_rad.resize(rows, 3);
    for_each_absolute([&](const Sensor&, LogMatrix& m) { m.resize(rows, 0); }, log);
    log.specific_force_m_s2.resize(rows, 3);
    log.angular_velocity_rad_s.resize(rows, 3);
    const CableVector none = CableVector::Constant(n_, kNaN);
    for (Eigen::Index row = 0; row < rows; ++row) {
      const RobotSample& s = samples_[static_cast<std::size_t>(row)];
      log.time_s[row] = s.time_s;
      log.length_m.row(row) = s.length_m.size() == n_ ? s.length_m : none;
      log.swivel_rad.row(row) = s.swivel_rad.size() == n_ ? s.swivel_rad : none;
      log.tension_N.row(row) = s.tension_N.size() == n_ ? s.tension_N : none;
      log.tension_setpoint_N.row(row) = setpoints_[static_cast<std::size_t>(row)];
      log.roll_pitch_yaw_rad.row(row) = s.roll_pitch_yaw_rad;
      log.specific_force_m_s2.row(row) = s.specific_force_m_s2;
      log.angular_velocity_rad_s.row(row) = s.angular_velocity_rad_s;
    }
    for (LogMatrix* m : {&log.specific_force_m_s2, &log.angular_velocity_rad_s}) {
      if (!m->array().isFinite().any()) m->resize(rows, 0);
    }
    return log;
  }

 private:
  int n_;
  std::vector<RobotSample> samples_;
  std::vector<CableVector> setpoints_;
};

SampleRange rows_within(const Eigen::VectorXd& time_s, double begin_s, double end_s) {
  const double* first = time_s.data();
  const double* last = first + time_s.size();
  return {std::lower_bound(first, last, begin_s - 1e-9) - first,
          std::upper_bound(first, last, end_s + 1e-9) - first};
}

}  // namespace

StartUpRun simulate_startup(const Robot& robot, const StartUpPlan& plan,
                            const StartUpRunOptions& options) {
  if (!(options.control_rate_Hz > 0.0) || !(options.log_rate_Hz > 0.0) ||
      options.log_rate_Hz > options.control_rate_Hz) {
    throw InputError("start-up run: rates must be positive, log_rate_Hz at most control_rate_Hz");
  }
  StartUp startup(robot, plan, options.startup);
  SimulatorOptions plant = options.simulator;
  // A drive with a tension loop of its own is given a limit that planned motion does not reach.
  if (plant.winch.mode == WinchMode::tension) {
    plant.winch.max_velocity_m_s =
        std::min(plant.winch.max_velocity_m_s, 1.5 * startup.velocity_limit_m_s());
  }
  Simulator simulator(robot, plant);
  StartUpRun run;
  const CableVector initial_N =
      options.initial_tension_N.size() > 0 ? options.initial_tension_N : plan.setpoint_N.front();
  const RestResult placed =
      plan.pose.empty() || !holds_orientation(robot)
          ? simulator.reset(initial_N)
          : simulator.reset(options.initial_pose.value_or(plan.pose.front()), initial_N);
  if (!placed.found) {
    run.reason = "the robot cannot hang at its initial tensions: " + placed.reason;
    return run;
  }

  Recorder recorder(robot.cable_count());
  const double period_s = 1.0 / options.control_rate_Hz;
  std::int64_t logged = 0;
  bool stop = false;
  for (std::int64_t tick = 0;; ++tick) {
    RobotSample sample = simulator.read();
    sample.stop_requested = stop;
    if (simulator.time_s() > options.max_duration_s) sample.stop_requested = true;
    if (!simulator.crashed().empty()) sample.drive_error = simulator.crashed();
    if (options.tamper) options.tamper(sample);
    const StartUpCommand& command = startup.step(sample);

    if (run.changes.empty() || run.changes.back().state != command.state ||
        run.changes.back().setpoint != command.setpoint) {
      run.changes.push_back({simulator.time_s(), command.state, command.setpoint});
    }
    const auto n = static_cast<double>(logged);
    if (simulator.time_s() >= n / options.log_rate_Hz - 1e-9) {
      ++logged;
      if (recorder.add(sample, command.tension_setpoint_N)) {
        run.truth.push_back(simulator.truth());
        run.max_tension_N = std::max(run.max_tension_N, run.truth.back().tension_N.maxCoeff());
      }
    }
    const CableVector& wanted = command.tension_setpoint_N;
    run.min_setpoint_N = std::fmin(run.min_setpoint_N, wanted.minCoeff());
    run.max_setpoint_N = std::fmax(run.max_setpoint_N, wanted.maxCoeff());
    run.max_velocity_m_s =
        std::max(run.max_velocity_m_s, command.velocity_m_s.cwiseAbs().maxCoeff());
    if (options.progress && !options.progress(command, sample)) stop = true;
    if (startup.finished()) break;

    const bool has_loop = options.simulator.winch.mode != WinchMode::velocity;
    if (command.locked) {
      simulator.hold();
    } else if (has_loop) {
      simulator.command_each(command.velocity_m_s, command.tension_setpoint_N, command.by_tension);
    } else {
      simulator.command_velocity(command.velocity_m_s);
    }
    // When the plant has stopped (a collision), time still goes on until StartUp notices and holds.
    if (!simulator.advance(static_cast<double>(tick + 1) * period_s - simulator.time_s()) &&
        command.state == StartUpState::holding) {
      break;
    }
  }
  run.state = startup.state();
  run.reason = startup.reason();
  run.log = recorder.log("simulated start-up of " + robot.name);
  run.rests = startup.rests();
  for (const StartUpRest& rest : run.rests) {
    run.rest_rows.push_back(rows_within(run.log.time_s, rest.begin_s, rest.end_s));
  }
  return run;
}

}  // namespace cdprcal
