// Cable tensions that balance gravity at a pose, and their derivatives.
#pragma once

#include <vector>

#include "cdprcal/statics/wrench.hpp"

namespace cdprcal {

/// Which statics the static poses obey.
enum class StaticsModel {
  none,          ///< j = lσε
  left_inverse,  ///< eqs 10–12: modelled tensions against measured ones
  wrench         ///< eq. 6, all six equations: Ξᵀτ* − f against the noise of τ* mapped through Ξᵀ
};

/// Rows of the wrench in Euler-rate coordinates Dᵀf, ω = H(ε) ε̇ (the dual of (ṗ, ε̇)).
enum class WrenchRow { force_x, force_y, force_z, moment_roll, moment_pitch, moment_yaw };

/// The n rows that the left inverse of eq. 12 solves. For four cables x, y, z and yaw, as in the
/// recorded results; the literal "first n rows" is singular on symmetry axes. Throws for n > 6.
std::vector<WrenchRow> left_inverse_rows(int cable_count);

struct TensionModel {
  bool valid = false;      ///< false: a cable is not valid, or the equations are singular here
  CableVector tension_N;   ///< τ(ζ)
  CableJacobian by_twist;  ///< ∂τ/∂δ (n×6)
};

/// Tensions by the paper's left inverse (eqs 11, 12) on `rows` (as many as cables).
TensionModel tensions_left_inverse(const Robot& robot, const PlatformState& state,
                                   const std::vector<WrenchRow>& rows);

/// Tensions of least squared wrench error: min ‖S(Ξᵀτ − f)‖, S scaling moments by
/// 1/characteristic_length so that both halves are newtons. Not valid for more than 6 cables or a
/// structure matrix without full rank.
TensionModel tensions_least_squares(const Robot& robot, const PlatformState& state);

}  // namespace cdprcal
