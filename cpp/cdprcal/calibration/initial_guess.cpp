#include "cdprcal/calibration/initial_guess.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/estimation/presence.hpp"
#include "cdprcal/kinematics/motion.hpp"

namespace cdprcal {
namespace {

/// Weighted residuals of absolute readings as normal equations; returns the cost, NaN off-domain.
double normal_equations(const Robot& robot, const AbsoluteReadings& readings, const Pose& pose,
                        Matrix6& hessian, Vector6& gradient) {
  PoseEvaluation modelled;
  evaluate_geometry(robot, platform_state(robot, pose), pose, true, modelled);
  if (!modelled.valid) return kNaN;
  hessian.setZero();
  gradient.setZero();
  double cost = 0.0;
  const auto add = [&](double residual, const Eigen::Matrix<double, 1, 6>& row, double sigma) {
    if (!std::isfinite(residual)) return;
    const double weight = 1.0 / (sigma * sigma);
    cost += 0.5 * weight * residual * residual;
    hessian.noalias() += weight * row.transpose() * row;
    gradient.noalias() += weight * residual * row.transpose();
  };
  const SensorSigma& sigma = robot.sigma;
  for (int i = 0; i < robot.cable_count(); ++i) {
    add(modelled.length_m[i] - readings.length_m[i], modelled.length_by_twist.row(i),
        sigma.length_m);
    const double swivel = modelled.swivel_rad[i] - readings.swivel_rad[i];
    if (std::isfinite(swivel)) {
      add(wrap_angle(swivel), modelled.swivel_by_twist.row(i), sigma.swivel_rad);
    }
  }
  for_each_absolute(
      [&](const Sensor& sensor, auto& read, auto& model, auto& by_twist) {
        if (!sensor.is_length()) return;  // angles are among those below
        for (std::size_t i = 0; i < numbers(read).size(); ++i) {
          add(numbers(model)[i] - numbers(read)[i], by_twist.row(static_cast<Eigen::Index>(i)),
              sigma.*sensor.sigma);
        }
      },
      readings.absolute, modelled, modelled.absolute_by_twist);
  for (int a = 0; a < 3; ++a) {
    const double error = modelled.roll_pitch_yaw_rad[a] - readings.roll_pitch_yaw_rad[a];
    if (std::isfinite(error)) {
      add(wrap_angle(error), modelled.attitude_by_twist.row(a), sigma.attitude_rad);
    }
  }
  const FreeMotion free(robot);  // no step where guides prevent it
  hessian = free.of_square(hessian);
  gradient = free.of(gradient);
  return cost;
}

/// Readings at a pose without what known effects add to them there. `robot` has their geometry.
AbsoluteReadings without_effects(const Robot& robot, const ActiveEffects& effects,
                                 const Measurement& m, const Pose& pose) {
  AbsoluteReadings readings{m.length_m, m.swivel_rad, m.roll_pitch_yaw_rad, m};
  if (effects.empty()) return readings;
  PoseEvaluation with, without;
  evaluate_pose(robot, m, pose, StaticsModel::none, {}, effects, false, with);
  evaluate_geometry(robot, platform_state(robot, pose), pose, false, without);
  if (!with.valid || !without.valid) return readings;
  readings.length_m -= with.length_m - without.length_m;
  readings.swivel_rad -= with.swivel_rad - without.swivel_rad;
  readings.roll_pitch_yaw_rad -= with.roll_pitch_yaw_rad - without.roll_pitch_yaw_rad;
  return readings;
}

bool pulls(const CableVector& tension_N, int cable_count) {
  return tension_N.size() == cable_count && tension_N.allFinite() && tension_N.minCoeff() > 0.0;
}

/// Equilibrium at these readings of the load cells, near `start` if given; known effects correct
/// them, as seen from where the uncorrected ones would hold the platform.
std::optional<Pose> direct_guess(const Robot& robot, const Measurement& m,
                                 const CableVector& reading_N, const ActiveEffects& effects,
                                 const std::optional<Pose>& start = std::nullopt) {
  if (is_guided(robot) && !row_of(robot.platform.motion).is_point()) return std::nullopt;
  if (!pulls(reading_N, robot.cable_count())) return std::nullopt;
  EquilibriumResult direct = direct_from_tensions(robot, reading_N, start);
  if (direct.status != EquilibriumStatus::found) return std::nullopt;
  if (effects.empty()) return direct.pose;
  const PlatformState state = platform_state(robot, direct.pose);
  const CableVector tension_N =
      corrected_tension_N({robot, state, direct.pose, m}, effects, reading_N);
  if (!(tension_N.minCoeff() > 0.0)) return direct.pose;
  const EquilibriumResult corrected = direct_from_tensions(robot, tension_N, start);
  return corrected.status == EquilibriumStatus::found ? corrected.pose : direct.pose;
}

/// Where cables of these lengths let the platform hang.
std::optional<Pose> hanging(const Robot& robot, const CableVector& length_m, const Pose& start) {
  const bool held = !is_guided(robot) && robot.cable_count() < 6 && length_m.allFinite() &&
                    length_m.minCoeff() > 0.0;
  if (!held) return std::nullopt;
  const EquilibriumResult rest = direct_from_lengths(robot, length_m, start);
  const bool hangs =
      rest.status == EquilibriumStatus::found || rest.status == EquilibriumStatus::slack;
  return hangs ? std::optional(rest.pose) : std::nullopt;
}

/// Z_ideal: the equilibrium of the set-point, or of the measured tensions.
std::optional<Pose> ideal_pose(const Robot& robot, const Measurement& m,
                               const ActiveEffects& effects, const std::optional<Pose>& start) {
  if (auto pose = direct_guess(robot, m, m.tension_setpoint_N, effects, start)) return pose;
  return direct_guess(robot, m, m.tension_N, effects, start);
}

/// How badly tensions, where all were read, balance at a pose [nat]; 0 where they were not.
double unbalanced(const Robot& robot, const CableVector& tension_N, const Pose& pose) {
  if (tension_N.size() != robot.cable_count() || !tension_N.allFinite()) return 0.0;
  const double off_N = unbalanced_N(robot, platform_state(robot, pose), tension_N);
  const double sigma_N = robot.sigma.tension_N;
  return 0.5 * off_N * off_N / (sigma_N * sigma_N * robot.cable_count());
}

/// The best fit from several starts; of those that fit alike, the one that balances best, and the
/// first.
std::optional<Pose> best_estimate(const Robot& robot, const AbsoluteReadings& readings,
                                  const std::vector<Pose>& starts,
                                  const CableVector& tension_N = {}) {
  constexpr double kBetter = 1e-3;
  std::optional<Pose> best;
  double least = std::numeric_limits<double>::infinity();
  Matrix6 hessian;
  Vector6 gradient;
  for (const Pose& start : starts) {
    const Pose pose = estimate_pose(robot, readings, start);
    const double cost = normal_equations(robot, readings, pose, hessian, gradient) +
                        unbalanced(robot, tension_N, pose);
    if (!(cost + kBetter * (1.0 + cost) < least)) continue;
    least = cost;
    best = pose;
  }
  return best;
}

/// Of a platform that turns in its plane: the best fit from near a pose at several turns, and from
/// the reference.
Pose turned_right(const Robot& robot, const AbsoluteReadings& readings, const Measurement& m,
                  const Pose& near, const Pose& reference) {
  std::vector<Pose> starts{near};
  for (const double turn_rad : {0.0, 0.5, -0.5}) {
    starts.push_back({near.position_m, exp_so3(turn_rad * robot.platform.motion_plane_normal)});
  }
  starts.push_back(reference);
  const bool rests = m.kind == PoseKind::static_pose;
  return best_estimate(robot, readings, starts, rests ? m.tension_N : CableVector()).value_or(near);
}

/// Where absolute sensors see the reference: the best fit to their readings, from its measured
/// position or any of the other guesses. Nothing when none of them sees where it is.
std::optional<Pose> absolute_guess(const Robot& robot, const Measurement& m,
                                   const Eigen::Quaterniond& attitude,
                                   const std::vector<Pose>& others) {
  bool seen = false;
  for_each_absolute(
      [&](const Sensor& sensor, auto& read) {
        const auto finite =
            std::ranges::count_if(numbers(read), [](double v) { return std::isfinite(v); });
        seen = seen || (sensor.is_length() && finite >= 3);
      },
      m);
  if (!seen) return std::nullopt;
  AbsoluteReadings readings{CableVector::Constant(robot.cable_count(), kNaN),
                            CableVector::Constant(robot.cable_count(), kNaN),
                            {m.roll_pitch_yaw_rad[0], m.roll_pitch_yaw_rad[1], m.absolute_yaw_rad},
                            m};
  std::vector<Pose> starts = others;
  if (m.position_m.allFinite()) {
    starts.insert(starts.begin(), on_motion(robot, {m.position_m, attitude}));
  }
  return best_estimate(robot, readings, starts);
}

/// Roll and pitch as measured (0 where absent), yaw as given.
Eigen::Quaterniond measured_attitude(const Robot& robot, const Measurement& m, double yaw_rad) {
  const auto up = readings_of(m, Channel::specific_force);
  const bool felt = up.size() == 3 && up.allFinite() && up.norm() > 0.0;
  if (felt && !m.roll_pitch_yaw_rad.head<2>().allFinite()) {
    const double heading_rad = std::isfinite(yaw_rad) ? yaw_rad : 0.0;
    return Eigen::AngleAxisd(heading_rad, Vector3::UnitZ()) *
           rotation_between(up, Vector3::UnitZ());
  }
  Vector3 angles{m.roll_pitch_yaw_rad[0], m.roll_pitch_yaw_rad[1], yaw_rad};
  angles = angles.unaryExpr([](double a) { return std::isfinite(a) ? a : 0.0; });
  return rotation_from_euler(angles, robot.euler_convention);
}

/// How far below the pulleys platforms hang, for want of anything better.
double usual_depth_m(const Robot& robot) {
  const Vector3 span = pulley_box(robot).extent_m();
  return 0.5 * std::max({span.x(), span.y(), robot_size_m(robot) / std::sqrt(2.0)});
}

/// The digits of k in a base, mirrored at the point: in [0, 1).
double radical_inverse(int k, int base) {
  double out = 0.0, digit = 1.0;
  for (; k > 0; k /= base) out += (digit /= base) * (k % base);
  return out;
}

}  // namespace

Pose estimate_pose(const Robot& robot, const AbsoluteReadings& readings, const Pose& start) {
  Pose best = start;
  Matrix6 hessian;
  Vector6 gradient;
  double cost = normal_equations(robot, readings, best, hessian, gradient);
  if (!std::isfinite(cost)) return best;
  constexpr int kMostSteps = 50;
  double damping = 1e-6;
  for (int step = 0; step < kMostSteps; ++step) {
    Matrix6 damped = hessian;
    damped.diagonal() *= 1.0 + damping;
    damped.diagonal().array() += 1e-9 * hessian.diagonal().maxCoeff() * damping + 1e-12;
    const Vector6 move = -solve_symmetric(damped, gradient);
    if (!move.allFinite()) break;
    const Pose trial = on_motion(robot, plus(best, move));  // damping is not along guides
    Matrix6 trial_hessian;
    Vector6 trial_gradient;
    const double trial_cost =
        normal_equations(robot, readings, trial, trial_hessian, trial_gradient);
    if (trial_cost < cost) {
      const bool settled = cost - trial_cost < 1e-9 * cost || move.norm() < 1e-9;
      best = trial;
      cost = trial_cost;
      hessian = trial_hessian;
      gradient = trial_gradient;
      damping = std::max(1e-9, 0.1 * damping);
      if (settled) break;
    } else {
      damping *= 10.0;
      if (damping > 1e9) break;
    }
  }
  return best;
}

std::optional<Pose> hanging_near(const Robot& robot, const Pose& pose) {
  const PlatformState state = platform_state(robot, pose);
  return state.valid ? hanging(robot, state.length_m(), pose) : std::nullopt;
}

std::vector<Pose> reference_guesses(const Robot& given, const Measurement& reference,
                                    const ActiveEffects& effects) {
  const Robot robot = with_effects(given, effects);
  std::vector<Pose> guesses;
  for (const CableVector& tension_N : {reference.tension_setpoint_N, reference.tension_N}) {
    if (const auto pose = direct_guess(robot, reference, tension_N, effects)) {
      guesses.push_back(*pose);
    }
  }
  // A cross of positions below the pulleys: platforms hang there.
  const auto [low, high] = pulley_box(robot);
  const Vector3 span = high - low;
  const double depth = usual_depth_m(robot);
  const Eigen::Quaterniond attitude =
      measured_attitude(robot, reference, reference.absolute_yaw_rad);
  constexpr std::array<std::array<double, 3>, 7> kSpread{{{0.0, 0.0, -0.75},
                                                          {0.0, 0.0, -1.5},
                                                          {0.25, 0.0, -1.0},
                                                          {-0.25, 0.0, -1.0},
                                                          {0.0, 0.25, -1.0},
                                                          {0.0, -0.25, -1.0},
                                                          {0.0, 0.0, -0.4}}};
  const auto add = [&](const Vector3& position) {
    const Pose pose = on_motion(robot, {position, attitude});
    if (platform_state(robot, pose).valid) guesses.push_back(pose);
  };
  const auto cross = [&](double raised, double height) {
    for (const auto& [x, y, z] : kSpread) {
      add(0.5 * (low + high) + Vector3(x * span.x(), y * span.y(), (z + raised) * height));
    }
  };
  const auto between = [&] { cross(1.0, span.z()); };  // as platforms of frames all around do
  const bool guided = is_guided(robot);
  const bool around = guided && span.z() > 0.5 * std::max(span.x(), span.y());
  if (around) between();
  cross(0.0, depth);
  if (!around && (guided || robot.cable_count() >= 6)) between();
  if (const auto seen = absolute_guess(robot, reference, attitude, guesses)) {
    guesses.insert(guesses.begin(), *seen);
  }
  if (guesses.empty()) {
    guesses.push_back(on_motion(robot, {0.5 * (low + high) - Vector3(0, 0, depth), attitude}));
  }
  return guesses;
}

std::vector<Pose> spread_guesses(const Robot& robot, const Measurement& reference, int count) {
  constexpr double kDeep = 4.0;  // times the usual depth
  constexpr double kTurned_rad = 40.0 * kDegree;
  const auto [low, high] = pulley_box(robot);
  const Vector3 span = high - low, middle = 0.5 * (low + high);
  const double deepest_m = kDeep * usual_depth_m(robot);
  const bool heads = std::isfinite(reference.absolute_yaw_rad);
  std::vector<Pose> guesses;
  for (int k = 1; static_cast<int>(guesses.size()) < count && k <= 2 * count; ++k) {
    const auto off_middle = [k](int base) { return radical_inverse(k, base) - 0.5; };
    const Vector3 at(middle.x() + off_middle(2) * span.x(), middle.y() + off_middle(3) * span.y(),
                     high.z() - deepest_m * radical_inverse(k, 5));
    const double yaw_rad = heads ? reference.absolute_yaw_rad : 2.0 * kTurned_rad * off_middle(7);
    const Pose pose = on_motion(robot, {at, measured_attitude(robot, reference, yaw_rad)});
    if (platform_state(robot, pose).valid) guesses.push_back(pose);
  }
  return guesses;
}

std::vector<Pose> measurement_guesses(const Robot& given,
                                      const std::vector<Measurement>& measurements,
                                      const Pose& reference_guess, const ActiveEffects& effects,
                                      RestGuess rests, const std::vector<Pose>& known) {
  const Robot robot = with_effects(given, effects);
  const PlatformState initial = platform_state(robot, reference_guess);
  if (!initial.valid) return std::vector<Pose>(measurements.size(), reference_guess);
  const CableVector length0 = initial.length_m();
  const CableVector swivel0 = initial.swivel_rad();
  const Vector3 angles0 = euler_from_rotation(initial.rotation, robot.euler_convention);
  const AbsoluteReadings reference =
      without_effects(robot, effects, measurements.front(), reference_guess);
  // A platform in a plane turns over between one pose and the next, in what a fit makes of it.
  const bool may_turn_over = is_guided(robot) && !row_of(robot.platform.motion).is_point();
  std::vector<Pose> guesses{reference_guess};
  std::size_t taken = 1;  // of those known, the reference
  for (std::size_t i = 1; i < measurements.size(); ++i) {
    const Measurement& m = measurements[i];
    Pose pose = guesses.back();
    if (m.kind == PoseKind::static_pose && taken < known.size()) {
      guesses.push_back(known[taken++]);
      continue;
    }
    if (rests == RestGuess::ideal && m.kind == PoseKind::static_pose) {
      auto ideal = ideal_pose(robot, m, effects, pose);
      if (!ideal && !m.tension_N.array().isFinite().any()) {
        ideal = hanging(robot, m.length_m + length0 - reference.length_m, pose);
      }
      if (ideal) {
        guesses.push_back(*ideal);
        continue;
      }
    }
    // Effects on the readings depend on the pose: a second pass sees them from near the right one.
    for (int pass = 0; pass < (effects.empty() ? 1 : 2); ++pass) {
      AbsoluteReadings readings = without_effects(robot, effects, m, pose);
      readings.length_m += length0 - reference.length_m;
      readings.swivel_rad += swivel0 - reference.swivel_rad;
      readings.roll_pitch_yaw_rad[2] += angles0[2] - reference.roll_pitch_yaw_rad[2];
      pose = may_turn_over ? turned_right(robot, readings, m, pose, reference_guess)
                           : estimate_pose(robot, readings, pose);
    }
    guesses.push_back(pose);
  }
  return guesses;
}

std::optional<CalibrationProblem> kept_upright(const CalibrationProblem& problem,
                                               const Pose& reference) {
  const bool known = is_guided(problem.robot) || is_read(problem, Channel::roll_pitch) ||
                     is_read(problem, Channel::specific_force) ||
                     reads_tensions(problem.measurements);
  if (known) return std::nullopt;
  constexpr double kLittle_rad = 0.1;
  CalibrationProblem out = problem;
  out.noise.reset();
  out.robot.sigma.attitude_rad = out.robot.sigma.absolute_yaw_rad = kLittle_rad;
  const Vector3 angles =
      euler_from_rotation(reference.rotation_matrix(), problem.robot.euler_convention);
  const bool heads = is_read(problem, Channel::absolute_yaw);
  for (Measurement& m : out.measurements) {
    m.roll_pitch_yaw_rad.head<2>() = angles.head<2>();
    if (!heads) m.absolute_yaw_rad = angles[2];
  }
  return out;
}

}  // namespace cdprcal
