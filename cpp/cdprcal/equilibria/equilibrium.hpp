// What every equilibrium solver returns, and the two notions of stability.
#pragma once

#include <string>

#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/statics/wrench.hpp"

namespace cdprcal {

enum class EquilibriumStatus {
  found,            ///< balanced to machine precision and stable; every cable carries tension ≥ 0
  obstructed,       ///< found, were there nothing in the way (kinematics/obstruction.hpp)
  unstable,         ///< balanced, but the platform would leave this pose at the slightest touch
  infeasible,       ///< balanced, but a tension is outside the robot's limits (inverse problem)
  slack,            ///< balanced, but a cable hangs loose: it is on fewer cables than asked
  not_found,        ///< no balanced pose was reached; the pose is NaN
  invalid_geometry  ///< an anchor sits inside a pulley or on its swivel axis; the pose is NaN
};

const char* to_string(EquilibriumStatus status);

/// Preference: 0 for found, then in the order of the list above.
inline int rank(EquilibriumStatus status) { return static_cast<int>(status); }

/// How firmly an equilibrium holds: smallest eigenvalues of the two stiffnesses [N/m], where a
/// rotation is measured as the arc at the platform's characteristic length (so both halves of a
/// twist are metres). Positive means stable.
struct Stability {
  /// Cables locked at their lengths (winch brakes, length control): K_f of eq. A4, the motions
  /// that no cable length resists. This is the paper's criterion for the static workspace.
  /// +∞ when the cables leave no freedom.
  double locked_lengths_N_m = kNaN;
  /// Cables held at constant tensions (force control, the start-up procedure of §3.2.2): the whole
  /// K + Q, the Hessian of Σ τ l + m g z_G. It demands more than the other: locked cables take
  /// away motions, constant tensions do not.
  double constant_tensions_N_m = kNaN;
};

/// Both notions at a pose that is in balance. Needs a valid state.
Stability stability(const Robot& robot, const PlatformState& state, const CableVector& tension_N);

/// Whether K_f of eq. A4, or the whole of `stiffness` (K + Q at the state), is positive definite,
/// without eigenvalues or heap: for hot loops.
bool stable_with_locked_lengths(const PlatformState& state, const Matrix6& stiffness,
                                double length_scale_m);
bool stable_with_constant_tensions(const Matrix6& stiffness, double length_scale_m);

/// One equilibrium, or the reason why there is none. When status is not_found or invalid_geometry
/// every number below is NaN: a failure can never be taken for a pose.
struct EquilibriumResult {
  EquilibriumStatus status = EquilibriumStatus::not_found;
  std::string reason;  ///< one sentence for people; empty when found
  Pose pose{Vector3::Constant(kNaN), Eigen::Quaterniond(kNaN, kNaN, kNaN, kNaN)};
  CableVector tension_N;
  CableVector length_m;
  bool stable = false;  ///< by the notion that fits the problem (see each solver)
  Stability stability;
  double residual_N = kNaN;  ///< ‖Ξᵀτ − f‖, moments divided by the characteristic length
  int evaluations = 0;       ///< of the robot's kinematics, over all starts

  /// Whether the pose is an equilibrium at all, whatever else is wrong with it.
  [[nodiscard]] bool balanced() const {
    return status != EquilibriumStatus::not_found && status != EquilibriumStatus::invalid_geometry;
  }
};

/// ‖Ξᵀτ − f‖ [N], moments divided by the length scale (characteristic_length_m).
double balance_error_N(const Vector6& wrench_residual, double length_scale_m);
/// The same of a pose, without what guides carry.
double unbalanced_N(const Robot& robot, const PlatformState& state, const CableVector& tension_N);

}  // namespace cdprcal
