// Static balance of the platform (paper eqs 6, 7) and its derivatives: the stiffness of eq. A5.
// At a state that is not valid (a cable without a tangent) the results are NaN.
#pragma once

#include "cdprcal/kinematics/platform.hpp"

namespace cdprcal {

/// Structure matrix Ξᵀ (6×n), eq. 7: column i is (t, a′ × t), world axes, about P.
/// Ξᵀτ is the wrench the platform puts on its cables; Ξᵀ is also (∂l/∂δ)ᵀ.
WrenchMatrix structure_matrix(const PlatformState& state);

/// f of eq. 6 [N, Nm]: weight and its moment about P, world axes.
Vector6 gravity_wrench(const Robot& robot, const PlatformState& state);

/// Ξᵀτ − f [N, Nm]: zero at a static equilibrium.
Vector6 wrench_residual(const Robot& robot, const PlatformState& state,
                        const CableVector& tension_N);

/// K of eq. A5 (6×6): ∂(Ξᵀτ)/∂δ at constant tensions.
Matrix6 tension_stiffness(const PlatformState& state, const CableVector& tension_N);

/// Q (6×6): −∂f/∂δ = −[0, 0; 0, g̃ s̃′].
/// Eq. A5 prints +s̃′g̃, whose symmetric part has the opposite sign; the Hessian of the potential
/// (tested numerically) has this one.
Matrix6 gravity_stiffness(const Robot& robot, const PlatformState& state);

/// K + Q: ∂(Ξᵀτ − f)/∂δ. At an equilibrium it is the Hessian of the potential energy.
Matrix6 stiffness(const Robot& robot, const PlatformState& state, const CableVector& tension_N);

/// K_f of eq. A4, ((6−n)×(6−n)): K + Q on the motions that no cable length resists. Symmetric.
/// 0×0 when the cables leave no freedom.
Eigen::MatrixXd free_motion_stiffness(const Robot& robot, const PlatformState& state,
                                      const CableVector& tension_N);

/// An orthonormal basis Ξ⊥ (6×m) of the motions that no cable length resists (Ξ Ξ⊥ = 0).
Eigen::MatrixXd free_motion_basis(const PlatformState& state);

/// Potential energy at constant tensions [J]: Σ τ l + m g z_G. Its gradient along a twist is
/// wrench_residual; its minima are the stable poses of a force-controlled robot.
double potential_energy(const Robot& robot, const Pose& pose, const PlatformState& state,
                        const CableVector& tension_N);

}  // namespace cdprcal
