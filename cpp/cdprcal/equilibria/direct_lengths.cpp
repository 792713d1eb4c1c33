// Direct problem from cable lengths: minimise z_G subject to l(ζ) ≤ l*, and polish the active set.
#include <Eigen/LU>
#include <algorithm>
#include <array>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/equilibria/distinct.hpp"
#include "cdprcal/equilibria/pose_search.hpp"
#include "cdprcal/equilibria/starts.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/statics/tension.hpp"

namespace cdprcal {
namespace {

using Mask = std::array<bool, kMaxCables>;
/// The Karush–Kuhn–Tucker system: six balance equations and up to six taut cables.
using KktMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 12, 12>;
using KktVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 12, 1>;

void check_lengths(const Robot& robot, const CableVector& length_m) {
  const int n = robot.cable_count();
  if (n > freedoms(robot)) {
    throw InputError("direct_from_lengths: " + std::to_string(n) +
                     " cables over-determine the pose (at most " + std::to_string(freedoms(robot)) +
                     "); which of them are taut depends on elasticity");
  }
  if (length_m.size() != n || n < 1) {
    throw InputError("direct_from_lengths: " + std::to_string(length_m.size()) + " lengths for " +
                     std::to_string(n) + " cables; give one a cable");
  }
  if (!length_m.allFinite() || (length_m.array() <= 0.0).any()) {
    throw InputError("direct_from_lengths: lengths must be finite and positive [m]");
  }
}

class LengthProblem {
 public:
  LengthProblem(const Robot& robot, const CableVector& length_m, const DirectOptions& options)
      : robot_(robot),
        target_m_(length_m),
        options_(options),
        free_(robot),
        length_scale_m_(characteristic_length_m(robot)),
        size_m_(robot_size_m(robot)) {}

  /// NLopt to a minimum, then the active set.
  EquilibriumResult minimum(const Pose& start) {
    if (const PlatformState at = platform_state(robot_, on_motion(robot_, start)); !at.valid) {
      return failure(EquilibriumStatus::invalid_geometry, "the start: " + describe_invalid(at));
    }
    PoseObjective objective;
    objective.value = [&](const Pose& pose, const PlatformState& state, Vector6* gradient) {
      const Vector3& arm = state.centre_of_mass_arm_m;
      if (gradient != nullptr) *gradient << Vector3::UnitZ(), arm.cross(Vector3::UnitZ());
      return pose.position_m.z() + arm.z();
    };
    objective.constraint_count = robot_.cable_count();
    objective.constraint = [&](const Pose&, const PlatformState& state, CableJacobian* rows) {
      if (rows != nullptr) *rows = length_jacobian(state);
      return CableVector(state.length_m() - target_m_);
    };
    PoseSearchOptions search;
    search.length_scale_m = length_scale_m_;
    search.max_evaluations = options_.max_evaluations;
    const PoseSearchResult found =
        search_pose(robot_, start, search_bounds(robot_), objective, search);
    evaluations_ += found.evaluations;
    const PlatformState state = platform_state(robot_, found.pose);
    if (state.valid && (state.length_m() - target_m_).maxCoeff() > 1e-3 * size_m_) {
      return failure(EquilibriumStatus::not_found,
                     "the cables are too short: no pose is within the reach of all of them");
    }
    if (!found.finished) return failure(EquilibriumStatus::not_found, found.message);
    return polish(found.pose, true);
  }

  /// Newton from a pose. With `release`, cables that would push are let loose and cables that come
  /// out too long are taken in again, until both signs are right; without, all cables stay taut.
  EquilibriumResult polish(const Pose& start, bool release) {
    Mask taut{};
    std::fill_n(taut.begin(), robot_.cable_count(), true);
    Pose pose = on_motion(robot_, start);
    if (release) {
      const PlatformState state = platform_state(robot_, pose);
      if (!state.valid)
        return failure(EquilibriumStatus::invalid_geometry, describe_invalid(state));
      for (int i = 0; i < robot_.cable_count(); ++i) {
        taut[i] = state.cable[i].length_m > target_m_[i] - 1e-4 * size_m_;
      }
    }
    for (int change = 0; change <= 2 * robot_.cable_count(); ++change) {
      CableVector tension_N;
      std::string reason;
      if (!newton(taut, pose, tension_N, reason)) {
        return failure(EquilibriumStatus::not_found, reason);
      }
      if (!release || !change_set(pose, tension_N, taut)) return accept(pose, tension_N, taut);
    }
    return failure(EquilibriumStatus::not_found, "which cables are slack could not be settled");
  }

 private:
  /// Newton on [Ξᵀτ − f; l − l*] over (δ, τ) for the taut cables; the others have no tension.
  bool newton(const Mask& taut, Pose& pose, CableVector& tension_N, std::string& reason) {
    const int n = robot_.cable_count();
    std::array<int, kMaxCables> active{};
    int m = 0;
    for (int i = 0; i < n; ++i) {
      if (taut[i]) active[m++] = i;
    }
    const double weight = std::max(robot_.weight_N(), 1e-12);
    tension_N = CableVector::Zero(n);
    Pose current = pose;
    CableVector tension = tension_N;
    double best = HUGE_VAL;
    int stalled = 0;
    for (int step = 0; step <= options_.max_newton_steps; ++step) {
      const PlatformState state = platform_state(robot_, current);
      ++evaluations_;
      if (!state.valid) {
        reason = describe_invalid(state);
        break;
      }
      const WrenchMatrix structure = free_.of(structure_matrix(state));
      const Vector6 load = free_.of(gravity_wrench(robot_, state));
      if (step == 0) {  // multipliers that fit the start best
        Eigen::MatrixXd columns(6, m);
        for (int k = 0; k < m; ++k) columns.col(k) = structure.col(active[k]);
        const CableVector fit = least_squares(columns, load).x;
        for (int k = 0; k < m; ++k) tension[active[k]] = fit[k];
      }
      const Vector6 balance = structure * tension - load;
      KktVector residual(6 + m);
      residual.head<6>() = balance;
      double stretch = 0.0;
      for (int k = 0; k < m; ++k) {
        residual[6 + k] = state.cable[active[k]].length_m - target_m_[active[k]];
        stretch = std::max(stretch, std::abs(residual[6 + k]));
      }
      const double error =
          std::max(balance_error_N(balance, length_scale_m_) / weight, stretch / size_m_);
      if (error < best) {
        best = error;
        stalled = 0;
        pose = current;
        tension_N = tension;
      } else if (++stalled > (best <= options_.tolerance ? 0 : 8)) {
        break;
      }
      KktMatrix kkt = KktMatrix::Zero(6 + m, 6 + m);
      kkt.topLeftCorner<6, 6>() = free_.of_stiffness(stiffness(robot_, state, tension));
      for (int k = 0; k < m; ++k) {
        kkt.block<6, 1>(0, 6 + k) = structure.col(active[k]);
        kkt.block<1, 6>(6 + k, 0) = structure.col(active[k]).transpose();
      }
      KktVector move = -Eigen::PartialPivLU<KktMatrix>(kkt).solve(residual);
      if (!move.allFinite() || move.head<6>().norm() > 1e6 * size_m_) {
        // A neutral motion, such as the spin of a platform on one cable: take the shortest step.
        move = -least_norm(Eigen::MatrixXd(kkt), Eigen::VectorXd(residual));
      }
      if (!move.allFinite()) break;
      const double size =
          std::max({1.0, move.head<3>().norm() / (0.2 * size_m_), move.segment<3>(3).norm() / 0.5});
      const Vector6 twist = move.head<6>() / size;
      current = plus(current, twist);
      for (int k = 0; k < m; ++k) tension[active[k]] += move[6 + k] / size;
    }
    if (best <= options_.tolerance) return true;
    if (reason.empty()) reason = "no balanced pose has these cable lengths near the start";
    return false;
  }

  /// Lets go of the cable that pushes most, or takes in the one that is most too long.
  bool change_set(const Pose& pose, const CableVector& tension_N, Mask& taut) const {
    const PlatformState state = platform_state(robot_, pose);
    int push = -1;
    int longest = -1;
    for (int i = 0; i < robot_.cable_count(); ++i) {
      const double excess = state.cable[i].length_m - target_m_[i];
      if (taut[i] && tension_N[i] < -1e-9 * robot_.weight_N() &&
          (push < 0 || tension_N[i] < tension_N[push])) {
        push = i;
      }
      if (!taut[i] && excess > 1e-9 * size_m_ &&
          (longest < 0 || excess > state.cable[longest].length_m - target_m_[longest])) {
        longest = i;
      }
    }
    if (longest >= 0) return taut[longest] = true;
    if (push >= 0) taut[push] = false;
    return push >= 0;
  }

  EquilibriumResult accept(const Pose& pose, const CableVector& tension_N, const Mask& taut) const {
    EquilibriumResult result;
    const PlatformState state = platform_state(robot_, pose);
    result.pose = pose;
    result.tension_N = tension_N;
    result.length_m = state.length_m();
    result.residual_N = unbalanced_N(robot_, state, tension_N);
    result.evaluations = evaluations_;
    result.stability = taut_stability(state, tension_N, taut);
    result.stable = result.stability.locked_lengths_N_m > 0.0;
    result.status = result.stable ? EquilibriumStatus::found : EquilibriumStatus::unstable;
    if (!result.stable) result.reason = "the centre of mass can sink without stretching a cable";
    for (int i = 0; i < robot_.cable_count(); ++i) {
      if (!taut[i] || tension_N[i] < 0.0) {
        result.status = EquilibriumStatus::slack;
        result.reason = "cable " + std::to_string(i + 1) +
                        (taut[i] ? " would have to push" : " hangs loose at these lengths");
        break;
      }
    }
    return result;
  }

  /// Loose cables hold nothing back: they do not count as locked.
  Stability taut_stability(const PlatformState& state, const CableVector& tension_N,
                           const Mask& taut) const {
    PlatformState held = state;
    CableVector tension = tension_N;
    held.cable_count = 0;
    for (int i = 0; i < robot_.cable_count(); ++i) {
      if (!taut[i]) continue;
      held.cable[held.cable_count] = state.cable[i];
      held.anchor_arm_m[held.cable_count] = state.anchor_arm_m[i];
      tension[held.cable_count++] = tension_N[i];
    }
    return stability(robot_, held, CableVector(tension.head(held.cable_count)));
  }

  EquilibriumResult failure(EquilibriumStatus status, const std::string& reason) const {
    EquilibriumResult result;
    result.status = status;
    result.reason = reason;
    result.evaluations = evaluations_;
    return result;
  }

  const Robot& robot_;
  const CableVector& target_m_;
  const DirectOptions& options_;
  FreeMotion free_;
  double length_scale_m_;
  double size_m_;
  int evaluations_ = 0;
};

}  // namespace

EquilibriumResult direct_from_lengths(const Robot& robot, const CableVector& length_m,
                                      const std::optional<Pose>& start,
                                      const DirectOptions& options) {
  check_lengths(robot, length_m);
  LengthProblem problem(robot, length_m, options);
  EquilibriumResult best;
  if (start) {
    best = problem.polish(*start, false);
    if (best.status == EquilibriumStatus::found) return best;
    best = problem.minimum(*start);
    if (best.status == EquilibriumStatus::found) return best;
  }
  const auto [rotations, likely] = start_rotations(robot);
  for (std::size_t k = 0; k < rotations.size(); ++k) {
    // A true rest: no need for more, if it is known before a start, or before the odd ones.
    if ((k == 0 || k == likely) && best.status == EquilibriumStatus::slack) break;
    const CableVector equal = CableVector::Ones(robot.cable_count());
    const double drop_m = drop_for_lengths(robot, rotations[k], length_m);
    const EquilibriumResult result =
        problem.minimum(hanging_pose(robot, rotations[k], equal, drop_m));
    if (result.status == EquilibriumStatus::found) return result;
    if (best.reason.empty() || (result.balanced() && !best.stable)) best = result;
  }
  return best;
}

std::vector<EquilibriumResult> all_equilibria_from_lengths(const Robot& robot,
                                                           const CableVector& length_m,
                                                           const DirectOptions& options) {
  check_lengths(robot, length_m);
  LengthProblem problem(robot, length_m, options);
  DistinctEquilibria distinct(robot);
  for (const Eigen::Quaterniond& rotation : start_rotations(robot).all) {
    const CableVector equal = CableVector::Ones(robot.cable_count());
    const Pose start =
        hanging_pose(robot, rotation, equal, drop_for_lengths(robot, rotation, length_m));
    for (EquilibriumResult result : {problem.minimum(start), problem.polish(start, false)}) {
      if (!result.balanced()) continue;
      // All cables taut but one pushing is no equilibrium of a cable robot.
      if ((result.tension_N.array() < -1e-9 * robot.weight_N()).any()) continue;
      const double height =
          result.pose.position_m.z() + (result.pose.rotation * robot.platform.centre_of_mass_m).z();
      distinct.add(result, height);
    }
  }
  return distinct.sorted();
}

}  // namespace cdprcal
