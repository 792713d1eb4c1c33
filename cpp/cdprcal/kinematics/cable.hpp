// One cable on a swivel pulley: everything that follows from q = A − D (paper §2, eqs 1–5).
#pragma once

#include "cdprcal/model/robot.hpp"

namespace cdprcal {

enum class CableStatus {
  ok,
  anchor_inside_pulley,  ///< q is closer to the pulley's centre than its radius: no tangent exists
  anchor_on_swivel_axis  ///< u·q = 0: the swivel angle is undefined
};

/// Zero-order kinematics. Vectors are unit vectors in world axes. NaN unless status is ok.
struct CableState {
  CableStatus status = CableStatus::ok;
  double length_m = 0.0;           ///< l, eq. 5: free part plus the arc on the pulley
  double swivel_rad = 0.0;         ///< σ, eq. 2
  double tangency_rad = 0.0;       ///< ψ, eq. 4
  double free_length_m = 0.0;      ///< ‖ρ‖
  double radial_distance_m = 0.0;  ///< u·q
  Vector3 radial;                  ///< u: from D to the pulley centre C
  Vector3 groove_normal;           ///< w = k × u
  Vector3 contact;                 ///< n: from C to B, where the cable leaves
  Vector3 direction;               ///< t: along the cable, from B to the platform
};

/// First derivatives with respect to q [m] and to the pulley radius [m].
struct CableDerivatives {
  Vector3 length_by_q;     ///< t
  Vector3 swivel_by_q;     ///< w / (u·q)
  Vector3 tangency_by_q;   ///< n / ‖ρ‖
  Matrix3 direction_by_q;  ///< T of eq. A5: also the Hessian of the length
  double length_by_radius = 0.0;
  double tangency_by_radius = 0.0;
  Vector3 direction_by_radius;  ///< the swivel angle does not depend on the radius
};

/// State for q [m], world axes, from pulley entry D to platform anchor A.
CableState cable_state(const Pulley& pulley, const Vector3& q_world_m);

/// Derivatives at a state whose status is ok.
CableDerivatives cable_derivatives(const Pulley& pulley, const CableState& state);

/// ∂l/∂q, ∂σ/∂q need no T: the cheap part of cable_derivatives, for hot loops.
inline Vector3 swivel_by_q(const CableState& state) {
  return state.groove_normal / state.radial_distance_m;
}
Matrix3 direction_by_q(const CableState& state);

const char* to_string(CableStatus status);

}  // namespace cdprcal
