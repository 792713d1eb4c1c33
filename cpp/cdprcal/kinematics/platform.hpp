// The whole robot: pose → all cables, and how lengths and swivels move with the pose.
#pragma once

#include <array>

#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/kinematics/cable.hpp"

namespace cdprcal {

/// Inverse kinematics at one pose (eqs 2–5 for every cable).
struct PlatformState {
  bool valid = false;  ///< every cable's status is ok
  int cable_count = 0;
  Matrix3 rotation;                              ///< R_world_platform
  std::array<Vector3, kMaxCables> anchor_arm_m;  ///< R a′: from P to A, world axes
  Vector3 centre_of_mass_arm_m;                  ///< R s′: from P to G, world axes
  std::array<CableState, kMaxCables> cable;

  [[nodiscard]] CableVector length_m() const;
  [[nodiscard]] CableVector swivel_rad() const;
};

PlatformState platform_state(const Robot& robot, const Pose& pose);

/// ∂l/∂δ (n×6) for a world-frame twist δ: row i is (t, a′ × t)ᵀ, the column ξ of eq. 7.
CableJacobian length_jacobian(const PlatformState& state);
/// ∂σ/∂δ (n×6): row i is (w, a′ × w)ᵀ / (u·q).
CableJacobian swivel_jacobian(const PlatformState& state);

/// First reason why a state is not valid, with the cable's number from 1; empty when it is.
std::string describe_invalid(const PlatformState& state);

}  // namespace cdprcal
