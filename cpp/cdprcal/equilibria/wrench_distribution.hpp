// Tension distributions of as many cables as the platform has freedoms f and more: they hold the
// orientation, too, so a whole pose is commanded, and what is left to choose are tensions that pull
// against each other. f is 6, less where guides carry what the cables need not (motion.hpp).
//
// With X = BᵀΞᵀ (f×n), B the basis of what may move, every τ with Xτ = Bᵀf is τ = X⁺Bᵀf + Nλ:
// N (n×(n−f)) an orthonormal basis of the null space of X, λ [N] free.
#pragma once

#include <optional>

#include "cdprcal/equilibria/distribution.hpp"
#include "cdprcal/kinematics/motion.hpp"

namespace cdprcal {

/// From so many cables on a robot's lengths hold its whole pose: as many as it has freedoms.
inline int cables_that_hold(const Robot& robot) { return freedoms(robot); }
inline bool holds_orientation(const Robot& robot) {
  return robot.cable_count() >= cables_that_hold(robot);
}
/// More tensions that are free than this, and none is chosen.
inline constexpr int kMostFree = 2;

/// All tensions in balance with the weight at a pose. N follows the rule of TensionFamily, with f
/// in place of three: its last n−f rows are lower triangular with a positive diagonal. Where the
/// last cables' tensions cannot be changed the cables whose tensions can stand in their place.
TensionFamily wrench_family(const Robot& robot, const PlatformState& state);

/// Tensions by one distribution, f ≤ n ≤ f + kMostFree; without derivatives. barycentre: the
/// centroid of the polytope within the limits, so it is there exactly where the pose is
/// wrench-feasible; otherwise polytope_exists is false and λ is where the limits are missed by
/// least. `given_lambda_N` has n−f values. No heap.
DistributedTension distribute_wrench(const Robot& robot, const PlatformState& state,
                                     TensionDistribution distribution,
                                     const CableVector& given_lambda_N = {});

/// The tensions in balance at a pose that are closest to given ones (least squares); empty where
/// the cables do not hold all directions.
CableVector balanced_near(const Robot& robot, const PlatformState& state,
                          const CableVector& tension_N);

/// Tensions of least norm that put this wrench [N, Nm] on the cables: X⁺w; empty where the cables
/// do not hold all six directions.
CableVector tensions_of_least_norm(const Robot& robot, const PlatformState& state,
                                   const Vector6& wrench);

/// The orientation in which a robot whose lengths hold it is commanded when nobody says: that of
/// the robot file's platform frame where it leaves at least half of the places wrench-feasible that
/// the best turn about the vertical, of a quarter at most, leaves; else that turn. Places: a
/// lattice in the middle of the robot.
Eigen::Quaterniond held_orientation(const Robot& robot);

}  // namespace cdprcal
