#include "cdprcal/synthetic/synthetic.hpp"

#include "cdprcal/decompositions.hpp"
#include "cdprcal/effects/effect.hpp"
#include "cdprcal/effects/pose_evaluation.hpp"
#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/equilibria/held_motion.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/kinematics/platform.hpp"

namespace cdprcal {

std::uint64_t RandomNormal::next() {
  // SplitMix64 (Steele, Lea, Flood 2014)
  state_ += 0x9e3779b97f4a7c15ULL;
  std::uint64_t z = state_;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

double RandomNormal::uniform() { return (static_cast<double>(next() >> 11) + 0.5) * 0x1.0p-53; }

double RandomNormal::operator()() {
  const double radius = std::sqrt(-2.0 * std::log(uniform()));
  return radius * std::cos(2.0 * kPi * uniform());
}

ReadingNoise reading_noise(const SensorSigma& sigma, double scale, bool absolute) {
  ReadingNoise noise;
  for_each_channel(
      [&](const ChannelRow& channel, double& value) {
        if (absolute || !channel.of().is_absolute()) value = scale * sigma.*channel.of().sigma;
      },
      noise);
  return noise;
}

ReadingOffsets random_offsets(int cable_count, RandomNormal& random) {
  if (cable_count < 1 || cable_count > kMaxCables) {
    throw InputError("cable_count: " + std::to_string(cable_count) + " cables; give 1 to " +
                     std::to_string(kMaxCables));
  }
  ReadingOffsets offsets{CableVector(cable_count), CableVector(cable_count), 0.0};
  for (int i = 0; i < cable_count; ++i) {
    offsets.length_m[i] = 2.0 * random.uniform() - 1.0;
    offsets.swivel_rad[i] = (2.0 * random.uniform() - 1.0) * 60.0 * kDegree;
  }
  offsets.yaw_rad = (2.0 * random.uniform() - 1.0) * kPi;
  return offsets;
}

Measurement synthetic_measurement(const Robot& robot, const Pose& pose,
                                  const CableVector& tension_N, PoseKind kind,
                                  const ReadingOffsets& offsets, const ReadingNoise& noise,
                                  RandomNormal& random) {
  const PlatformState state = platform_state(robot, pose);
  if (!state.valid)
    throw InputError("synthetic measurement: " + describe_invalid(state) + "; give another pose");
  Measurement m;
  m.kind = kind;
  m.length_m = state.length_m() + offsets.length_m;
  m.swivel_rad = state.swivel_rad() + offsets.swivel_rad;
  m.tension_N = tension_N;
  m.roll_pitch_yaw_rad = euler_from_rotation(state.rotation, robot.euler_convention);
  m.roll_pitch_yaw_rad[2] += offsets.yaw_rad;
  for (int i = 0; i < robot.cable_count(); ++i) {
    m.length_m[i] += noise.length_m * random();
    m.swivel_rad[i] += noise.swivel_rad * random();
    m.tension_N[i] += noise.tension_N * random();
  }
  m.roll_pitch_yaw_rad[0] += noise.roll_pitch_rad * random();
  m.roll_pitch_yaw_rad[1] += noise.roll_pitch_rad * random();
  m.roll_pitch_yaw_rad[2] += noise.yaw_rad * random();
  PoseEvaluation exact;
  evaluate_geometry(robot, state, pose, false, exact);
  for_each_absolute(
      [&](const Sensor&, auto& reading, const auto& modelled, double sigma) {
        if (!std::isfinite(sigma)) return;
        reading = modelled;
        for (double& v : numbers(reading)) v += sigma * random();
      },
      m, exact, noise);
  return m;
}

namespace {

/// One wrench a set-point, from a stream of its own: readings are the same with and without.
std::vector<Vector6> disturbances(const SyntheticLogOptions& options, std::size_t count) {
  RandomNormal random(options.seed ^ 0x9e3779b97f4a7c15ULL);
  std::vector<Vector6> out(count, Vector6::Zero());
  for (Vector6& wrench : out) {
    for (double& v : wrench.head<3>()) v = options.wrench_force_N * random();
    for (double& v : wrench.tail<3>()) v = options.wrench_moment_Nm * random();
  }
  return out;
}

/// Where the platform rests at these tensions under one more wrench: Newton from where it rests
/// without. False where that leads nowhere.
bool yield_to(const Robot& robot, const CableVector& tension_N, const Vector6& wrench, Pose& pose) {
  if (wrench.isZero(0.0)) return true;
  constexpr int kSteps = 8;          // of quadratic convergence, from millimetres
  constexpr double kSettled = 1e-9;  // m, rad
  double last = HUGE_VAL;
  for (int i = 0; i < kSteps; ++i) {
    const PlatformState state = platform_state(robot, pose);
    const Vector6 left = wrench_residual(robot, state, tension_N) - wrench;
    const Vector6 step = solve_square(stiffness(robot, state, tension_N), left);
    pose = plus(pose, -step);
    last = step.norm();
    if (!(last >= 1e-14)) break;
  }
  return last < kSettled;
}

/// Where the platform is, and what its cables pull with, on the way from one set-point to the next.
class QuasiStatic {
 public:
  QuasiStatic(const Robot& robot, const std::vector<CableVector>& setpoints_N,
              const std::vector<Pose>& poses)
      : robot_(robot), setpoints_N_(setpoints_N), poses_(poses) {}

  /// A fraction of the way from set-point `index` to the next (0: at it), with this wrong wrench.
  void go_to(std::size_t index, double fraction, const Vector6& wrench) {
    const std::size_t next = std::min(index + 1, setpoints_N_.size() - 1);
    setpoint_N = setpoints_N_[index];
    setpoint_N += fraction * (setpoints_N_[next] - setpoints_N_[index]);
    const std::string why =
        poses_.empty() ? follow_tensions(wrench) : follow_poses(index, next, fraction, wrench);
    if (why.empty()) return;
    throw InputError("synthetic log: no stable equilibrium at set-point " +
                     std::to_string(index + 1) + (fraction > 0.0 ? " (moving on)" : "") + ": " +
                     why + "; give others");
  }

  Pose pose;
  CableVector setpoint_N, tension_N;

 private:
  std::string follow_tensions(const Vector6& wrench) {
    tension_N = setpoint_N;
    EquilibriumResult rest = direct_from_tensions(robot_, tension_N, previous_);
    if (rest.status != EquilibriumStatus::found) return rest.reason;
    if (!yield_to(robot_, tension_N, wrench, rest.pose)) {
      return "wrench_force_N and wrench_moment_Nm pull the platform away";
    }
    previous_ = pose = rest.pose;
    return {};
  }

  std::string follow_poses(std::size_t from, std::size_t to, double fraction,
                           const Vector6& wrench) {
    const HeldMotion motion(poses_[from], setpoints_N_[from], poses_[to], setpoints_N_[to]);
    const HeldPoint at = held_point(robot_, motion, fraction);
    if (at.tension_N.size() == 0) return "the cables do not hold the platform";
    pose = at.pose;
    setpoint_N = at.tension_N;
    tension_N = at.tension_N + tensions_of_least_norm(robot_, at.state, wrench);
    return tension_N.minCoeff() > 0.0 ? "" : "a cable is slack";
  }

  const Robot& robot_;
  const std::vector<CableVector>& setpoints_N_;
  const std::vector<Pose>& poses_;
  std::optional<Pose> previous_;
};

}  // namespace

SyntheticLog synthetic_log(const Robot& robot, const std::vector<CableVector>& setpoints_N,
                           const SyntheticLogOptions& options, const std::vector<Pose>& poses) {
  if (setpoints_N.empty()) throw InputError("synthetic log: no set-points; give at least one");
  if (!poses.empty() && (!holds_orientation(robot) || poses.size() != setpoints_N.size())) {
    throw InputError(
        "synthetic log: poses are for robots whose lengths hold them, one a set-point; leave them out");
  }
  if (!(options.rate_Hz > 0.0) || !(options.dwell_s >= 0.0) || !(options.move_s >= 0.0) ||
      !(options.dwell_s + options.move_s > 0.0)) {
    throw InputError("synthetic log: rate_Hz, dwell_s and move_s must be positive");
  }
  const double rows = (options.dwell_s + options.move_s) * options.rate_Hz *
                      static_cast<double>(setpoints_N.size());
  if (!(rows <= static_cast<double>(kMostLogLines))) {
    throw InputError("synthetic log: that would be more than " + std::to_string(kMostLogLines) +
                     " samples; lower rate_Hz, dwell_s or move_s");
  }
  const int n = robot.cable_count();
  RandomNormal random(options.seed);
  const ReadingOffsets offsets = random_offsets(n, random);
  const double period_s = options.dwell_s + options.move_s;
  const double duration_s = period_s * static_cast<double>(setpoints_N.size()) - options.move_s;
  const auto samples =
      static_cast<Eigen::Index>(std::floor(duration_s * options.rate_Hz + 1e-9)) + 1;

  SyntheticLog out;
  Log& log = out.log;
  log.source = "synthetic log of " + robot.name;
  log.time_s.resize(samples);
  log.length_m.resize(samples, n);
  log.swivel_rad.resize(samples, n);
  log.tension_N.resize(samples, n);
  log.tension_setpoint_N.resize(samples, n);
  log.roll_pitch_yaw_rad.resize(samples, 3);
  for_each_absolute(
      [&](const Sensor& sensor, LogMatrix& values, double sigma) {
        values.resize(samples, std::isfinite(sigma) ? sensor.columns_of(n) : 0);
      },
      log, options.noise);
  const std::vector<Vector6> wrench = disturbances(options, setpoints_N.size());
  QuasiStatic platform(robot, setpoints_N, poses);
  for (Eigen::Index row = 0; row < samples; ++row) {
    const double time_s = static_cast<double>(row) / options.rate_Hz;
    const auto index =
        std::min(static_cast<std::size_t>(time_s / period_s), setpoints_N.size() - 1);
    const double into_move = time_s - static_cast<double>(index) * period_s - options.dwell_s;
    Vector6 disturbance = wrench[index];
    double fraction = 0.0;
    if (into_move > 0.0 && index + 1 < setpoints_N.size()) {
      fraction = fifth_degree(into_move / options.move_s);
      disturbance += fraction * (wrench[index + 1] - disturbance);
    }
    platform.go_to(index, fraction, disturbance);
    out.poses.push_back(platform.pose);
    const Measurement m =
        synthetic_measurement(robot, platform.pose, platform.tension_N, PoseKind::static_pose,
                              offsets, options.noise, random);
    log.time_s[row] = time_s;
    log.length_m.row(row) = m.length_m;
    log.swivel_rad.row(row) = m.swivel_rad;
    log.tension_N.row(row) = m.tension_N;
    log.tension_setpoint_N.row(row) = platform.setpoint_N;
    log.roll_pitch_yaw_rad.row(row) = m.roll_pitch_yaw_rad;
    for_each_absolute(
        [&](const Sensor&, LogMatrix& values, auto& reading) {
          for (Eigen::Index c = 0; c < values.cols(); ++c) {
            values(row, c) = numbers(reading)[static_cast<std::size_t>(c)];
          }
        },
        log, m);
  }
  return out;
}

}  // namespace cdprcal
