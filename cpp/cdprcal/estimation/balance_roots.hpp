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
  double force_N = 0.0;
  double moment_Nm = 0.0;
};

/// W (lower triangular) with Wᵀ W the inverse of Ξᵀ diag(σ_τ²) Ξ + diag(σ_f², σ_m²) at each pose,
/// so that W (Ξᵀτ − f) has independent components of unit variance. NaN where the kinematics have
/// no solution. `sigma`: one a pose, σ_f and σ_m positive.
std::vector<Matrix6> inverse_balance_roots(const Robot& robot, const std::vector<Pose>& poses,
                                           const std::vector<BalanceSigma>& sigma);

}  // namespace cdprcal
