#include "cdprcal/simulator/simulator.hpp"

#include <algorithm>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/equilibria/wrench_distribution.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/statics/tension.hpp"

namespace cdprcal {
namespace {

/// Newton on the plant's own balance of forces from a pose close to it. Numeric derivatives: the
/// plant has effects that the analytic ones of statics/ do not know.
bool balance(const PlantDynamics& plant, const Robot& robot, const CableVector& tension_N,
             Pose& pose) {
  const double length_m = characteristic_length_m(robot);
  const double weight = robot.weight_N();
  const auto error = [&](const Vector6& w) {
    return std::max(w.head<3>().norm(), w.tail<3>().norm() / length_m) / weight;
  };
  const FreeMotion free(robot);
  pose = on_motion(robot, pose);
  Vector6 wrench = free.of(plant.net_wrench(pose, tension_N));
  for (int iteration = 0; iteration < 50; ++iteration) {
    if (!wrench.allFinite()) return false;
    if (error(wrench) < 1e-11) return true;
    Matrix6 jacobian;
    constexpr double kStep = 1e-6;
    for (int c = 0; c < 6; ++c) {
      const Vector6 delta = kStep * Vector6::Unit(c);
      jacobian.col(c) = (plant.net_wrench(plus(pose, delta), tension_N) -
                         plant.net_wrench(plus(pose, -delta), tension_N)) /
                        (2.0 * kStep);
    }
    if (!jacobian.allFinite()) return false;
    Vector6 move = -solve_square(free.of_stiffness(jacobian), wrench);
    if (!move.allFinite()) return false;
    move /= std::max({1.0, move.head<3>().norm() / 0.1, move.tail<3>().norm() / 0.2});
    const Pose next = plus(pose, move);
    const Vector6 next_wrench = free.of(plant.net_wrench(next, tension_N));
    // At the limit of the arithmetic: no further progress.
    if (error(wrench) < 1e-9 && !(error(next_wrench) < error(wrench))) return true;
    pose = next;
    wrench = next_wrench;
  }
  return wrench.allFinite() && error(wrench) < 1e-9;
}

void check_count(const CableVector& values, int n, const char* what) {
  if (values.size() != n || !values.allFinite()) {
    throw InputError(std::string("simulator: ") + what + ": give " + std::to_string(n) +
                     " finite numbers, one a cable");
  }
}

}  // namespace

Simulator::Simulator(const Robot& robot, const SimulatorOptions& options)
    : Simulator(plant_parameters(robot, options), options) {}

Simulator::Simulator(PlantParameters parameters, const SimulatorOptions& options)
    : options_(options),
      parameters_(std::move(parameters)),
      dynamics_(parameters_, options),
      sensors_(parameters_, options),
      crashed_("not reset yet") {
  hold();
}

RestResult Simulator::start_at(const Pose& start, const CableVector& tension_N) {
  RestResult rest;
  rest.pose = start;
  rest.tension_N = tension_N;
  if (!balance(dynamics_, parameters_.robot, tension_N, rest.pose)) {
    rest.reason = "the plant with its effects has no equilibrium near the ideal one";
    return rest;
  }
  return begin(rest);
}

RestResult Simulator::begin(RestResult rest) {
  rest.found = true;
  dynamics_.place(rest.pose, rest.tension_N);
  sensors_.reset(dynamics_);
  next_event_ = 0;
  crashed_.clear();
  hold();
  return rest;
}

RestResult Simulator::reset(const CableVector& tension_N, const Pose* near) {
  check_count(tension_N, parameters_.robot.cable_count(), "tension_N");
  if (!(tension_N.minCoeff() > 0.0)) throw InputError("simulator: tension_N must be positive");
  const EquilibriumResult ideal = direct_from_tensions(
      parameters_.robot, tension_N, near != nullptr ? std::optional<Pose>(*near) : std::nullopt);
  if (ideal.status != EquilibriumStatus::found) return {false, ideal.reason, {}, {}};
  return start_at(ideal.pose, tension_N);
}

RestResult Simulator::reset(const Pose& pose) {
  const PlatformState state = platform_state(parameters_.robot, pose);
  if (!state.valid) return {false, describe_invalid(state), {}, {}};
  const EquilibriumResult ideal = direct_from_lengths(parameters_.robot, state.length_m(), pose);
  if (ideal.status != EquilibriumStatus::found) return {false, ideal.reason, {}, {}};
  if (!(ideal.tension_N.minCoeff() > 0.0)) return {false, "a cable is slack there", {}, {}};
  return start_at(ideal.pose, ideal.tension_N);
}

RestResult Simulator::reset(const Pose& pose, const CableVector& tension_N) {
  const Robot& robot = parameters_.robot;
  check_count(tension_N, robot.cable_count(), "tension_N");
  const PlatformState state = platform_state(robot, pose);
  if (!state.valid) return {false, describe_invalid(state), {}, {}};
  if (!is_on_motion(robot, pose)) {
    return {false, "the platform's motion does not take it there", {}, {}};
  }
  const FreeMotion free(robot);
  RestResult rest{false, "", pose, tension_N};
  const double length_m = characteristic_length_m(robot);
  // The plant's own balance, effects included, by tensions: linear in them but for sag and frame.
  for (int iteration = 0; iteration < 50; ++iteration) {
    const Vector6 wrench = free.of(dynamics_.net_wrench(pose, rest.tension_N));
    if (!wrench.allFinite()) break;
    if (balance_error_N(wrench, length_m) < 1e-10 * robot.weight_N()) {
      if (!(rest.tension_N.minCoeff() > 0.0)) return {false, "a cable is slack there", {}, {}};
      return begin(rest);
    }
    const CableVector change_N = tensions_of_least_norm(robot, state, wrench);
    if (change_N.size() == 0) break;
    rest.tension_N += change_N;
  }
  return {false, "the cables do not hold the platform there", {}, {}};
}

void Simulator::command_velocity(const CableVector& velocity_m_s) {
  const int n = parameters_.robot.cable_count();
  command_each(velocity_m_s, CableVector::Zero(n), std::vector<bool>(static_cast<std::size_t>(n)));
}

void Simulator::command_tension(const CableVector& tension_N) {
  const int n = parameters_.robot.cable_count();
  command_each(CableVector::Zero(n), tension_N,
               std::vector<bool>(static_cast<std::size_t>(n), true));
}

void Simulator::command_each(const CableVector& velocity_m_s, const CableVector& tension_N,
                             const std::vector<bool>& by_tension) {
  const int n = parameters_.robot.cable_count();
  check_count(velocity_m_s, n, "velocity_m_s");
  check_count(tension_N, n, "tension_N");
  if (static_cast<int>(by_tension.size()) != n) {
    throw InputError("simulator: by_tension: give " + std::to_string(n) + " values, one a cable");
  }
  const auto led = std::count(by_tension.begin(), by_tension.end(), true);
  const bool torque = options_.winch.mode == WinchMode::torque;
  if (torque && led != 0 && led != n) {
    throw InputError(
        "simulator: winches in torque mode do not follow lengths; take winches in tension or "
        "velocity mode");
  }
  command_ = {{}, velocity_m_s, {}};
  for (int i = 0; i < n; ++i) {
    if (!by_tension[static_cast<std::size_t>(i)]) continue;
    command_.mode[static_cast<std::size_t>(i)] = torque ? WinchMode::torque : WinchMode::tension;
    command_.values[i] = tension_N[i];
  }
  reads_tension_ = led > 0 && !torque;
  if (led > 0) note_reading_error();
}

void Simulator::hold() {
  command_ = {{}, CableVector::Zero(parameters_.robot.cable_count()), {}};
  reads_tension_ = false;
}

void Simulator::push(const Vector3& velocity_m_s, const Vector3& body_rate_rad_s) {
  if (!velocity_m_s.allFinite() || !body_rate_rad_s.allFinite()) {
    throw InputError("simulator: push: must be finite numbers");
  }
  dynamics_.set_motion(velocity_m_s, body_rate_rad_s);
}

void Simulator::happen() {
  const auto& events = parameters_.events;
  for (; next_event_ < events.size() && events[next_event_].time_s <= dynamics_.time_s() + 1e-9;
       ++next_event_) {
    events[next_event_].happen(dynamics_);
  }
}

void Simulator::note_reading_error() {
  command_.reading_error_N = sensors_.drive_reading_error_N(dynamics_);
}

bool Simulator::advance(double duration_s) {
  if (!(duration_s >= 0.0 && std::isfinite(duration_s))) {
    throw InputError("simulator: advance: a duration must be a number of seconds, 0 or more");
  }
  const double end_s = time_s() + duration_s - 0.5 * options_.step_s;
  while (crashed_.empty() && time_s() < end_s) {
    happen();
    const StepStatus status = dynamics_.step(command_);
    if (status != StepStatus::done) {
      crashed_ = status == StepStatus::into_pulley
                     ? "the platform ran into a pulley"
                     : "the simulator's step was not solved; take a shorter step_s";
      break;
    }
    sensors_.update(dynamics_);
    if (reads_tension_) note_reading_error();
  }
  return crashed_.empty();
}

PlantTruth Simulator::truth() const {
  const int n = parameters_.robot.cable_count();
  PlantTruth truth;
  truth.time_s = time_s();
  truth.pose = dynamics_.pose();
  const PlatformMotion& motion = dynamics_.motion();
  const Vector3 rate = motion.rotation * motion.body_rate_rad_s;
  const Vector3 arm = motion.rotation * parameters_.robot.platform.centre_of_mass_m;
  truth.twist << motion.velocity_m_s - rate.cross(arm), rate;
  truth.tension_N.resize(n);
  truth.load_cell_N.resize(n);
  truth.direction.resize(n);
  for (int i = 0; i < n; ++i) {
    truth.tension_N[i] = dynamics_.strand_tension_N(i);
    truth.load_cell_N[i] = dynamics_.load_cell_tension_N(i);
    truth.direction[i] = dynamics_.direction(i);
  }
  truth.energy = dynamics_.energy();
  return truth;
}

}  // namespace cdprcal
