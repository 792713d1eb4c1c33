// How well the balance of forces and moments is known at a pose, and at eight at a time.
#pragma once

#include <vector>

#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/model/robot.hpp"

namespace cdprcal {

/// What the balance at a pose may be wrong by: tensions of this σ, one a cable, and the model
/// itself.
struct BalanceSigma {
  CableVector tension_N;
  Vector6 wrench = Vector6::Zero();  ///< in world axes [N, Nm]
};
/// The model's own error, and what is not known of the motion of a measurement.
Vector6 wrench_sigma(double force_N, double moment_Nm, const Vector6& inertial);

/// W (lower triangular) with Wᵀ W the inverse of Ξᵀ diag(σ_τ²) Ξ + diag(σ_w²) at each pose,
/// so that W (Ξᵀτ − f) has independent components of unit variance. NaN where the kinematics have
/// no solution. `sigma`: one a pose, σ_w positive.
std::vector<Matrix6> inverse_balance_roots(const Robot& robot, const std::vector<Pose>& poses,
                                           const std::vector<BalanceSigma>& sigma);

}  // namespace cdprcal
