// The barycentre of {λ: low ≤ τ₀ + Nλ ≤ high} for one and two λ, exact, with its derivatives.
#pragma once

#include "cdprcal/equilibria/distribution.hpp"

namespace cdprcal {

/// The family and how it moves with `directions` motion coordinates (none or three).
struct MovingFamily {
  int cable_count = 0;
  int freedom = 0;  ///< of λ: 1 or 2
  int directions = 0;
  CableVector particular_N;                                           ///< τ₀
  NullBasis basis;                                                    ///< N
  std::array<Eigen::Matrix<double, kMaxCables, 1>, 3> particular_by;  ///< ∂τ₀, a direction
  std::array<Eigen::Matrix<double, kMaxCables, 2>, 3> basis_by;       ///< ∂N, a direction
};

struct Barycentre {
  bool exists = false;  ///< the polytope has an inside
  Eigen::Vector2d lambda_N = Eigen::Vector2d::Zero();
  std::array<Eigen::Vector2d, 3> by;  ///< ∂λ, a direction
};

/// Interval midpoint (one λ) or polygon centroid (two). When the polytope is empty: see
/// DistributedTension::polytope_exists; `nearest_miss` false: λ is then left at 0, sooner.
Barycentre barycentre(const MovingFamily& family, double low_N, double high_N,
                      bool nearest_miss = true);

}  // namespace cdprcal
