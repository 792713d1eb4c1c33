// Small oscillations of the platform about an equilibrium: how fast it swings, and in which way.
#pragma once

#include "cdprcal/statics/inertial_wrench.hpp"

namespace cdprcal {

/// One number a mode, at most six.
using ModeVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 6, 1>;
/// One twist (δp [m], δθ [rad], world axes, at P) a mode.
using ModeShapes = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;

/// Undamped modes, the slowest first.
struct Modes {
  ModeVector natural_frequency_hz;  ///< NaN for a motion that grows instead: not stable
  ModeShapes shape;                 ///< vᵀMv = 1
};

/// The six modes at constant tensions, as the platform swings under force control:
/// (K + Q) v = ω² M v. The state must be an equilibrium of these tensions.
Modes constant_tension_modes(const Robot& robot, const PlatformState& state,
                             const CableVector& tension_N);

/// The 6 − n modes of the free motions, which no cable length resists (paper [25], eq. A4):
/// Ξ⊥ᵀ(K + Q)Ξ⊥ w = ω² Ξ⊥ᵀMΞ⊥ w. As the platform swings when the winches are locked. None of
/// them is slower than the slowest at constant tensions.
Modes free_motion_modes(const Robot& robot, const PlatformState& state,
                        const CableVector& tension_N);

}  // namespace cdprcal
