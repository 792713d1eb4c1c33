// The balance of a platform at rest where load cells are missing, all of them or some, or where
// guides carry what nobody measures.
#pragma once

#include "cdprcal/estimation/balance_roots.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/kinematics/platform.hpp"
#include "cdprcal/readings/measurement.hpp"

namespace cdprcal {

/// Tensions that nobody reads, and what guides carry (Motion), are unknowns of their pose alone.
/// They leave of the six equations Ξᵀτ = f those that they cannot take part in: Q₂ᵀ(Ξᵀτ − f) = 0,
/// Q₂ an orthonormal basis of what they cannot carry. By variable projection (Golub and Pereyra
/// 1973; Kaufman 1975) the cost is that of all six with the best of them put in, and its gradient
/// is that at these.
struct PartialBalance {
  /// W (Ξᵀτ − f) is independent and of unit variance; its first rows, as many as are unknown, are
  /// zero.
  Matrix6 whitening = Matrix6::Zero();
  CableVector tension_N;                   ///< as read, or else what balances best
  CableJacobian tension_by_wrench;         ///< of what is not read, by a wrench Ξᵀτ − f; else 0
  Vector6 tension_gain = Vector6::Zero();  ///< of each row, see WeighedPoses::tension_gain
};

/// `tension_N`: NaN where not read. `guided`: the wrenches that guides carry, columns of a basis;
/// fewer than six unknowns with these. `load`: f [N, Nm]. `sigma` as for inverse_balance_roots;
/// those of unread tensions do not count.
PartialBalance partial_balance(const PlatformState& state, const CableVector& tension_N,
                               const TwistBasis& guided, const Vector6& load,
                               const BalanceSigma& sigma);

/// Equations that the balance leaves at a measurement: 6, fewer by each tension that is not read
/// and by what guides carry; 0 where it is not in balance.
int balance_equations(const Robot& robot, const Measurement& m);

}  // namespace cdprcal
