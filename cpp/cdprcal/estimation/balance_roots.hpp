// How well the balance of forces and moments is known at a pose, and at eight at a time.
#pragma once

#include <vector>

#include "cdprcal/kinematics/platform.hpp"

namespace cdprcal {

/// What the balance at a pose may be wrong by: tensions of this σ, and the model itself.
struct BalanceSigma {
  double tension_N = 0.0;
  double force_N = 0.0;
  double moment_Nm = 0.0;
};

/// Lower triangular L with L Lᵀ the covariance of the balance at one pose.
Matrix6 balance_root(const PlatformState& state, const BalanceSigma& sigma);

/// W (lower triangular) with Wᵀ W the inverse of σ_τ² ΞᵀΞ + diag(σ_f², σ_m²) at each pose, so that
/// W (Ξᵀτ − f) has independent components of unit variance. NaN where the kinematics have no
/// solution. `sigma`: one a pose, σ_f and σ_m positive.
std::vector<Matrix6> inverse_balance_roots(const Robot& robot, const std::vector<Pose>& poses,
                                           const std::vector<BalanceSigma>& sigma);

}  // namespace cdprcal
