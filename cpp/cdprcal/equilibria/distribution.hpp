// Tension distributions: which of the tensions that carry the weight a robot is given (eq. A2).
//
// With A = Ξ_Fᵀ (3×n, the force rows), every τ with Aτ = g is τ = A⁺g + Nλ: A⁺g the tensions of
// least norm, N (n×(n−3)) an orthonormal basis of the null space of A, λ [N] free. That is up to
// five cables, where statics choose the orientation; from six on see wrench_distribution.hpp.
#pragma once

#include <string>

#include "cdprcal/kinematics/platform.hpp"

namespace cdprcal {

enum class TensionDistribution {
  barycentre,    ///< centroid of the feasible polytope {λ: τ_min ≤ τ ≤ τ_max} (paper [39])
  minimum_norm,  ///< λ = 0
  mid_range,     ///< the τ closest to (τ_min + τ_max)/2 for every cable
  given_lambda   ///< λ as given
};

TensionDistribution parse_tension_distribution(const std::string& name);
const char* to_string(TensionDistribution distribution);

/// One column a tension that is free: n×(n−3) up to five cables, n×(n−6) from six on.
using NullBasis =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxCables, 2>;
/// One row of three (a rotation or a translation) a cable.
using CableRows3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::ColMajor, 5, 3>;

/// All tensions whose forces carry the weight at a pose.
///
/// N is fixed by a rule that does not depend on any solver: its columns are orthonormal and its
/// last n−3 rows are lower triangular with a positive diagonal. So for n = 4 raising λ raises the
/// tension of cable 4; for n = 5 raising λ₂ raises that of cable 5 and leaves cable 4 alone. N is
/// continuous (and differentiable) wherever the directions of cables 1 to 3 are independent.
struct TensionFamily {
  bool valid = false;          ///< false: the cables do not span what they are to carry
  CableVector minimum_norm_N;  ///< A⁺g
  NullBasis basis;             ///< N
};
TensionFamily force_family(const Robot& robot, const PlatformState& state);

/// λ = Nᵀτ (n−3 values; from six cables on n−6, of wrench_family) of given tensions at a pose: what
/// reproduces them with given_lambda. Empty when the family is not valid.
CableVector lambda_of(const Robot& robot, const PlatformState& state, const CableVector& tension_N);

/// Tensions by one distribution, with derivatives.
struct DistributedTension {
  bool valid = false;
  /// Barycentre only: false when no λ keeps all tensions within the limits; then λ is where the
  /// limits are missed by least (n = 5) or halfway between the two that conflict most (n = 4), so
  /// that τ stays a continuous function of the pose.
  bool polytope_exists = true;
  CableVector tension_N;
  CableVector lambda_N;
  CableRows3 by_rotation;  ///< ∂τ/∂δθ (n×3)
};

/// n = 3, 4, 5 (the caller checks). `given` is used by given_lambda only. No heap.
DistributedTension distribute(const Robot& robot, const PlatformState& state,
                              TensionDistribution distribution, const CableVector& given_lambda_N);

/// Distance [N] of the closest tension to its limit; negative outside: min(τ − τ_min, τ_max − τ).
double tension_margin_N(const Robot& robot, const CableVector& tension_N);

}  // namespace cdprcal
