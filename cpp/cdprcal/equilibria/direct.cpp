#include "cdprcal/equilibria/direct.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/equilibria/distinct.hpp"
#include "cdprcal/equilibria/pose_search.hpp"
#include "cdprcal/equilibria/starts.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/statics/tension.hpp"

namespace cdprcal {
namespace {

void check_tensions(const Robot& robot, const CableVector& tension_N) {
  if (tension_N.size() != robot.cable_count() || robot.cable_count() < 1) {
    throw InputError("direct_from_tensions: " + std::to_string(tension_N.size()) +
                     " tensions for " + std::to_string(robot.cable_count()) +
                     " cables; give one a cable");
  }
  if (!tension_N.allFinite() || (tension_N.array() < 0.0).any()) {
    throw InputError("direct_from_tensions: tensions must be finite and not negative [N]");
  }
}

/// Solves for constant tensions; counts what it costs.
class TensionProblem {
 public:
  TensionProblem(const Robot& robot, const CableVector& tension_N, const DirectOptions& options)
      : robot_(robot),
        tension_N_(tension_N),
        options_(options),
        free_(robot),
        length_scale_m_(characteristic_length_m(robot)),
        step_limit_m_(0.2 * robot_size_m(robot)) {}

  /// One of Newton's steps, no longer than a fifth of the robot and half a radian.
  Pose step_along(const Pose& pose, const Vector6& twist) const {
    const double size =
        std::max(twist.head<3>().norm() / step_limit_m_, twist.tail<3>().norm() / 0.5);
    return plus(pose, twist / std::max(1.0, size));
  }

  /// Newton on Ξᵀτ = f: any stationary pose of the potential, stable or not.
  EquilibriumResult newton(const Pose& start) {
    EquilibriumResult result;
    Pose pose = on_motion(robot_, start);
    PlatformState there;  // at result.pose
    Vector6 unbalanced = Vector6::Zero();
    const double weight = std::max(robot_.weight_N(), 1e-12);
    double best = HUGE_VAL;
    int stalled = 0;
    for (int step = 0; step <= options_.max_newton_steps; ++step) {
      const PlatformState state = platform_state(robot_, pose);
      ++evaluations_;
      if (!state.valid) {
        result.status = EquilibriumStatus::invalid_geometry;
        result.reason = describe_invalid(state);
        break;
      }
      const Vector6 residual = free_.of(wrench_residual(robot_, state, tension_N_));
      const double error = balance_error_N(residual, length_scale_m_);
      if (error < best) {
        best = error;
        stalled = 0;
        result.pose = pose;
        there = state;
        unbalanced = residual;
      } else if (++stalled > (best <= options_.tolerance * weight ? 0 : 8)) {
        break;  // as exact as rounding allows, or going nowhere
      }
      constexpr double kRounding = 1e-15;  // a step more could only be noise
      if (error <= kRounding * weight) break;
      const Vector6 twist = -solve_square(free_stiffness(state), residual);
      if (!twist.allFinite()) break;
      pose = step_along(pose, twist);
    }
    if (best <= options_.tolerance * weight) return accept(result.pose, there, unbalanced);
    if (result.status == EquilibriumStatus::invalid_geometry) return failure(result);
    result.reason = "Newton's method did not balance the platform";
    return failure(result);
  }

  /// Down the potential by Newton's steps while it is convex on the way: a pose close to its
  /// minimum. Nothing where it is not, or where a step leads up.
  std::optional<Pose> descend(const Pose& start) {
    constexpr int kMostSteps = 12;
    constexpr double kNear = 1e-3;  // of the weight: Newton's method does the rest
    const double weight = std::max(robot_.weight_N(), 1e-12);
    Pose pose = on_motion(robot_, start);
    double energy_J = HUGE_VAL;
    for (int step = 0; step < kMostSteps; ++step) {
      const PlatformState state = platform_state(robot_, pose);
      ++evaluations_;
      if (!state.valid) return std::nullopt;
      const double now_J = potential_energy(robot_, pose, state, tension_N_);
      const Matrix6 k = free_stiffness(state);
      const Eigen::LLT<Matrix6> factor(Matrix6(0.5 * (k + k.transpose())));
      if (!(now_J < energy_J) || factor.info() != Eigen::Success) return std::nullopt;
      energy_J = now_J;
      const Vector6 residual = free_.of(wrench_residual(robot_, state, tension_N_));
      if (balance_error_N(residual, length_scale_m_) < kNear * weight) return pose;
      const Vector6 twist = -factor.solve(residual);
      if (!twist.allFinite()) return std::nullopt;
      pose = step_along(pose, twist);
    }
    return std::nullopt;
  }

  /// To a minimum of the potential, by Newton's method where it is convex from the start on, by
  /// NLopt elsewhere.
  EquilibriumResult minimum(const Pose& start) {
    if (const std::optional<Pose> near = descend(start)) {
      const EquilibriumResult result = newton(*near);
      if (result.status == EquilibriumStatus::found) return result;
    }
    return search(start);
  }

  /// NLopt to a minimum, then Newton.
  EquilibriumResult search(const Pose& start) {
    EquilibriumResult result;
    if (const PlatformState at = platform_state(robot_, on_motion(robot_, start)); !at.valid) {
      result.status = EquilibriumStatus::invalid_geometry;
      result.reason = "the start: " + describe_invalid(at);
      return failure(result);
    }
    const double weight = std::max(robot_.weight_N(), 1e-12);
    PoseObjective objective;
    objective.value = [&](const Pose& pose, const PlatformState& state, Vector6* gradient) {
      if (gradient != nullptr) *gradient = wrench_residual(robot_, state, tension_N_) / weight;
      return potential_energy(robot_, pose, state, tension_N_) / weight;
    };
    PoseSearchOptions options;
    options.length_scale_m = length_scale_m_;
    options.max_evaluations = options_.max_evaluations;
    const PoseSearchResult found =
        search_pose(robot_, start, search_bounds(robot_), objective, options);
    evaluations_ += found.evaluations;
    if (found.at_bound) {
      result.reason = "the platform sinks without end: these tensions do not hold it";
      return failure(result);
    }
    result = newton(found.pose);
    if (!result.balanced()) {
      const int close = cable_at_pulley(found.pose);
      if (close > 0) {
        result.status = EquilibriumStatus::not_found;
        result.reason = "the platform is drawn into the pulley of cable " + std::to_string(close) +
                        ": its tension is too strong for the others and the weight";
      } else if (!found.finished) {
        result.reason += "; " + found.message;
      }
    }
    return result;
  }

  double potential(const EquilibriumResult& result) const {
    return potential_energy(robot_, result.pose, platform_state(robot_, result.pose), tension_N_);
  }

 private:
  [[nodiscard]] Matrix6 free_stiffness(const PlatformState& state) const {
    return free_.of_stiffness(stiffness(robot_, state, tension_N_));
  }

  EquilibriumResult accept(const Pose& pose, const PlatformState& state,
                           const Vector6& residual) const {
    EquilibriumResult result;
    result.pose = pose;
    result.tension_N = tension_N_;
    result.length_m = state.length_m();
    result.residual_N = balance_error_N(residual, length_scale_m_);
    result.stability = stability(robot_, state, tension_N_);
    result.stable = result.stability.constant_tensions_N_m > 0.0;
    result.status = result.stable ? EquilibriumStatus::found : EquilibriumStatus::unstable;
    if (!result.stable) result.reason = "the potential has a saddle or a maximum here";
    result.evaluations = evaluations_;
    return result;
  }

  /// Number (from 1) of a cable with next to no free length left; 0: none.
  int cable_at_pulley(const Pose& pose) const {
    const PlatformState state = platform_state(robot_, pose);
    for (int i = 0; i < state.cable_count; ++i) {
      const CableState& cable = state.cable[i];
      if (cable.status != CableStatus::ok || cable.free_length_m < 0.1 * step_limit_m_) {
        return i + 1;
      }
    }
    return 0;
  }

  EquilibriumResult failure(const EquilibriumResult& why) const {
    EquilibriumResult result;
    if (why.status == EquilibriumStatus::invalid_geometry) result.status = why.status;
    result.reason = why.reason;
    result.evaluations = evaluations_;
    return result;
  }

  const Robot& robot_;
  const CableVector& tension_N_;
  const DirectOptions& options_;
  FreeMotion free_;
  double length_scale_m_;
  double step_limit_m_;
  int evaluations_ = 0;
};

}  // namespace

EquilibriumResult direct_from_tensions(const Robot& robot, const CableVector& tension_N,
                                       const std::optional<Pose>& start,
                                       const DirectOptions& options) {
  check_tensions(robot, tension_N);
  TensionProblem problem(robot, tension_N, options);
  EquilibriumResult last;
  // |t_z| ≤ 1: without guides no pose can carry the weight.
  if (!is_guided(robot) && tension_N.sum() <= robot.weight_N()) {
    last.reason = "the tensions add up to less than the weight: no pose can be in balance";
    return last;
  }
  if (start) {
    last = problem.newton(*start);
    if (last.status == EquilibriumStatus::found) return last;
    last = problem.minimum(*start);
    if (last.status == EquilibriumStatus::found) return last;
  }
  for (const Eigen::Quaterniond& rotation : start_rotations(robot).all) {
    const double drop_m = drop_for_tensions(robot, rotation, tension_N);
    const EquilibriumResult result =
        problem.minimum(hanging_pose(robot, rotation, tension_N, drop_m));
    if (result.status == EquilibriumStatus::found) return result;
    if (last.reason.empty() || result.balanced()) last = result;
  }
  return last;
}

std::vector<EquilibriumResult> all_equilibria_from_tensions(const Robot& robot,
                                                            const CableVector& tension_N,
                                                            const DirectOptions& options) {
  check_tensions(robot, tension_N);
  TensionProblem problem(robot, tension_N, options);
  DistinctEquilibria distinct(robot);
  for (const Eigen::Quaterniond& rotation : start_rotations(robot).all) {
    const double drop_m = drop_for_tensions(robot, rotation, tension_N);
    const Pose start = hanging_pose(robot, rotation, tension_N, drop_m);
    for (const EquilibriumResult& result : {problem.minimum(start), problem.newton(start)}) {
      if (result.balanced()) distinct.add(result, problem.potential(result));
    }
  }
  return distinct.sorted();
}

}  // namespace cdprcal
