#include "cdprcal/equilibria/inverse.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include "cdprcal/equilibria/distinct.hpp"
#include "cdprcal/equilibria/pose_search.hpp"
#include "cdprcal/equilibria/starts.hpp"
#include "cdprcal/equilibria/wrench_distribution.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/kinematics/obstruction.hpp"
#include "cdprcal/statics/tension.hpp"

namespace cdprcal {
namespace {

/// Largest Newton step [rad]: beyond it the linearisation says nothing.
constexpr double kStepLimit = 0.3;
/// Tensions may pass a limit by this much of the range: rounding, not infeasibility.
constexpr double kLimitSlack = 1e-9;

}  // namespace

InverseSolver::InverseSolver(Robot robot, const InverseOptions& options)
    : robot_(std::move(robot)), options_(options), holds_(holds_orientation(robot_)) {
  const int n = robot_.cable_count();
  const int hold = cables_that_hold(robot_);
  if (is_guided(robot_) && (n < hold || n - hold > kMostFree)) {
    throw InputError(std::string("inverse geometrico-static problem: the motion ") +
                     to_string(robot_.platform.motion) + " needs " + std::to_string(hold) + " to " +
                     std::to_string(hold + kMostFree) + " cables, not " + std::to_string(n));
  }
  if (n < 3 && !holds_) {
    throw InputError("inverse geometrico-static problem: needs 3 cables or more, not " +
                     std::to_string(n) + "; with fewer the position cannot be chosen freely");
  }
  if (!(robot_.tension_min_N >= 0.0 && robot_.tension_min_N < robot_.tension_max_N &&
        std::isfinite(robot_.tension_max_N))) {
    throw InputError("tension_limits_N: need 0 <= minimum < maximum");
  }
  const int free = n - (holds_ ? hold : 3);
  if (options_.distribution == TensionDistribution::given_lambda &&
      (options_.lambda_N.size() != free || !options_.lambda_N.allFinite())) {
    throw InputError("given_lambda: needs " + std::to_string(free) + " finite values of lambda_N");
  }
  if (options_.rotation && !holds_) {
    throw InputError("rotation: " + std::to_string(n) +
                     " cables do not hold an orientation, statics choose it; leave it out");
  }
  if (options_.rotation && !is_on_motion(robot_, {Vector3::Zero(), *options_.rotation})) {
    throw InputError(std::string("rotation: the motion ") + to_string(robot_.platform.motion) +
                     " does not allow it; leave it out");
  }
  if (holds_ && !options_.rotation) options_.rotation = held_orientation(robot_);
  length_scale_m_ = characteristic_length_m(robot_);
  moment_scale_Nm_ = std::max(robot_.weight_N(), 1e-12) * length_scale_m_;
}

InverseSolver::Moment InverseSolver::moment(const PlatformState& state) const {
  Moment m;
  m.tension = distribute(robot_, state, options_.distribution, options_.lambda_N);
  if (!m.tension.valid) return m;
  // Σ τ a′×t − s′×g, and its derivative: that at constant tensions plus Ξ_Mᵀ ∂τ.
  const CableVector& tension = m.tension.tension_N;
  m.value = -state.centre_of_mass_arm_m.cross(robot_.gravity_force_N());
  m.by_rotation = -skew(robot_.gravity_force_N()) * skew(state.centre_of_mass_arm_m);
  for (int i = 0; i < state.cable_count; ++i) {
    const Vector3& t = state.cable[i].direction;
    const Matrix3 arm = skew(state.anchor_arm_m[i]);
    const Vector3 lever = state.anchor_arm_m[i].cross(t);
    const Matrix3 arm_t = tension[i] * arm * direction_by_q(state.cable[i]);
    m.value += tension[i] * lever;
    m.by_rotation += tension[i] * (skew(t) * arm) - arm_t * arm;
    m.by_rotation += lever * m.tension.by_rotation.row(i);
  }
  m.valid = m.value.allFinite();
  return m;
}

InverseSolver::Point InverseSolver::continue_from(const Vector3& position_m,
                                                  const Eigen::Quaterniond& rotation) const {
  if (holds_) return held(position_m, rotation);
  Point point;
  point.rotation = rotation;
  double previous = HUGE_VAL;
  int grown = 0;
  for (point.steps = 0; point.steps <= options_.max_newton_steps; ++point.steps) {
    const PlatformState state = platform_state(robot_, {position_m, point.rotation});
    if (!state.valid) {
      point.status = EquilibriumStatus::invalid_geometry;
      return point;
    }
    const Moment m = moment(state);
    if (!m.valid) return point;
    const double error = m.value.norm();
    if (error <= options_.tolerance * moment_scale_Nm_) {
      point.tension_N = m.tension.tension_N;
      classify({position_m, point.rotation}, state, point);
      return point;
    }
    if (error > previous && ++grown > 3) return point;  // not in any basin
    previous = error;
    Vector3 step = -(m.by_rotation.inverse() * m.value);
    const double size = step.norm();
    if (!std::isfinite(size)) return point;
    if (size > kStepLimit) step *= kStepLimit / size;
    point.rotation = (exp_so3(step) * point.rotation).normalized();
  }
  return point;
}

InverseSolver::Point InverseSolver::held(const Vector3& position_m,
                                         const Eigen::Quaterniond& rotation) const {
  Point point;
  point.rotation = rotation;
  const Pose pose{position_m, rotation};
  if (!is_on_motion(robot_, pose)) return point;
  const PlatformState state = platform_state(robot_, pose);
  if (!state.valid) {
    point.status = EquilibriumStatus::invalid_geometry;
    return point;
  }
  const DistributedTension tension =
      distribute_wrench(robot_, state, options_.distribution, options_.lambda_N);
  if (!tension.valid) return point;
  point.tension_N = tension.tension_N;
  classify(pose, state, point);
  return point;
}

void InverseSolver::classify(const Pose& pose, const PlatformState& state, Point& point) const {
  point.margin_N = tension_margin_N(robot_, point.tension_N);
  if (point.margin_N < -kLimitSlack * (robot_.tension_max_N - robot_.tension_min_N)) {
    point.status = EquilibriumStatus::infeasible;
    return;
  }
  const auto held =
      is_clear(robot_, pose, state) ? EquilibriumStatus::found : EquilibriumStatus::obstructed;
  if (holds_ && options_.stability == StabilityNotion::locked_lengths) {
    point.status = held;  // no motion is left that lengths do not resist
    return;
  }
  if (is_guided(robot_)) {
    point.status = stability(robot_, state, point.tension_N).constant_tensions_N_m > 0.0
                       ? held
                       : EquilibriumStatus::unstable;
    return;
  }
  const Matrix6 hessian = stiffness(robot_, state, point.tension_N);
  const bool stable = options_.stability == StabilityNotion::locked_lengths
                          ? stable_with_locked_lengths(state, hessian, length_scale_m_)
                          : stable_with_constant_tensions(hessian, length_scale_m_);
  point.status = stable ? held : EquilibriumStatus::unstable;
}

InverseSolver::Point InverseSolver::search_from(const Vector3& position_m,
                                                const Eigen::Quaterniond& rotation,
                                                int* evaluations) const {
  if (holds_) return continue_from(position_m, rotation);
  PoseObjective objective;
  objective.value = [this](const Pose&, const PlatformState& state, Vector6* gradient) {
    const Moment m = moment(state);
    if (!m.valid) {
      if (gradient != nullptr) gradient->setZero();
      return HUGE_VAL;
    }
    const Vector3 scaled = m.value / moment_scale_Nm_;
    if (gradient != nullptr) {
      *gradient << Vector3::Zero(), m.by_rotation.transpose() * scaled / moment_scale_Nm_;
    }
    return 0.5 * scaled.squaredNorm();
  };
  PoseSearchOptions search;
  search.fixed_position = true;
  search.relative_tolerance = 1e-5;
  search.max_evaluations = options_.max_evaluations;
  const PoseSearchResult found = search_pose(robot_, {position_m, rotation}, {}, objective, search);
  if (evaluations != nullptr) *evaluations += found.evaluations;
  const Point point = continue_from(position_m, found.pose.rotation);
  if (evaluations != nullptr) *evaluations += point.steps + 1;
  return point;
}

InverseSolver::Point InverseSolver::solve(const Vector3& position_m, int* evaluations) const {
  if (holds_) {
    if (evaluations != nullptr) ++*evaluations;
    return held(position_m, *options_.rotation);
  }
  Point best;
  best.rotation = Eigen::Quaterniond(kNaN, kNaN, kNaN, kNaN);
  bool any = false;
  for (const Eigen::Quaterniond& rotation : start_rotations(robot_).all) {
    const Point point = search_from(position_m, rotation, evaluations);
    if (point.status == EquilibriumStatus::found) return point;
    if (!any || rank(point.status) < rank(best.status)) best = point;
    any = true;
  }
  return best;
}

InverseResult InverseSolver::describe(const Vector3& position_m, const Point& point) const {
  InverseResult result;
  const Pose pose{position_m, point.rotation};
  result.status = point.status;
  result.evaluations = point.steps + 1;
  switch (point.status) {
    case EquilibriumStatus::invalid_geometry:
      result.reason = "a platform anchor would be inside a pulley or on its swivel axis";
      return result;
    case EquilibriumStatus::not_found:
      result.reason = !holds_ ? "no orientation balances the moments at this position"
                      : is_on_motion(robot_, pose)
                          ? "the cables do not hold the platform in all directions there"
                          : "the platform's motion does not take it there";
      return result;
    case EquilibriumStatus::infeasible:
      result.reason = "a tension misses its limits by " + std::to_string(-point.margin_N) + " N";
      break;
    case EquilibriumStatus::obstructed:
      result.reason = obstruction(robot_, pose, platform_state(robot_, pose));
      break;
    case EquilibriumStatus::unstable:
      result.reason = "the equilibrium is not stable";
      break;
    default:
      break;
  }
  result.pose = pose;
  result.tension_N = point.tension_N;
  result.margin_N = point.margin_N;
  const PlatformState state = platform_state(robot_, result.pose);
  result.length_m = state.length_m();
  result.lambda_N = lambda_of(robot_, state, point.tension_N);
  result.residual_N = unbalanced_N(robot_, state, point.tension_N);
  result.stability = stability(robot_, state, point.tension_N);
  result.stable = (options_.stability == StabilityNotion::locked_lengths
                       ? result.stability.locked_lengths_N_m
                       : result.stability.constant_tensions_N_m) > 0.0;
  return result;
}

InverseResult inverse(const Robot& robot, const Vector3& position_m, const InverseOptions& options,
                      const std::optional<Eigen::Quaterniond>& start) {
  if (!position_m.allFinite()) throw InputError("position_m: must be finite [m]");
  const InverseSolver solver(robot, options);
  int evaluations = 0;
  InverseSolver::Point point;
  if (start) {
    point = solver.continue_from(position_m, *start);
    evaluations += point.steps + 1;
    if (point.status == EquilibriumStatus::not_found) {
      point = solver.search_from(position_m, *start, &evaluations);
    }
  }
  if (!start || point.status == EquilibriumStatus::not_found) {
    point = solver.solve(position_m, &evaluations);
  }
  InverseResult result = solver.describe(position_m, point);
  result.evaluations = evaluations;
  return result;
}

std::vector<InverseResult> all_equilibria_at(const Robot& robot, const Vector3& position_m,
                                             const InverseOptions& options) {
  if (!position_m.allFinite()) throw InputError("position_m: must be finite [m]");
  const InverseSolver solver(robot, options);
  std::vector<InverseResult> results;
  if (holds_orientation(robot)) {  // one, as commanded
    results.push_back(solver.describe(position_m, solver.solve(position_m)));
    if (!results.front().balanced()) results.clear();
    return results;
  }
  for (const Eigen::Quaterniond& rotation : start_rotations(robot).all) {
    for (const auto& point :
         {solver.search_from(position_m, rotation), solver.continue_from(position_m, rotation)}) {
      InverseResult result = solver.describe(position_m, point);
      if (!result.balanced()) continue;
      const bool known = std::any_of(results.begin(), results.end(), [&](const InverseResult& r) {
        return same_equilibrium(robot, r.pose, result.pose);
      });
      if (!known) results.push_back(std::move(result));
    }
  }
  std::stable_sort(results.begin(), results.end(), [](const auto& a, const auto& b) {
    if (a.status != b.status) return rank(a.status) < rank(b.status);
    return a.margin_N > b.margin_N;
  });
  return results;
}

}  // namespace cdprcal
