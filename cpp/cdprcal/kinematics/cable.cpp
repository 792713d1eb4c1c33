#include "cdprcal/kinematics/cable.hpp"

#include <limits>

namespace cdprcal {

namespace {

/// No number of a state without a tangent may pass for a result.
CableState invalid_state(CableStatus status, double radial_distance_m) {
  const Vector3 none = Vector3::Constant(kNaN);
  return {status, kNaN, kNaN, kNaN, kNaN, radial_distance_m, none, none, none, none};
}

}  // namespace

CableState cable_state(const Pulley& pulley, const Vector3& q_world_m) {
  CableState s;
  const double r = pulley.radius_m;
  const double q_i = pulley.axes_world.col(0).dot(q_world_m);
  const double q_j = pulley.axes_world.col(1).dot(q_world_m);
  const double q_k = pulley.axes_world.col(2).dot(q_world_m);
  const double q_u = std::sqrt(q_i * q_i + q_j * q_j);
  s.radial_distance_m = q_u;
  if (!(q_u > 0.0)) {
    return invalid_state(CableStatus::anchor_on_swivel_axis, q_u);
  }
  const double cos_swivel = q_i / q_u;
  const double sin_swivel = q_j / q_u;
  s.swivel_rad = std::atan2(q_j, q_i);  // eq. 2
  s.radial = cos_swivel * pulley.axes_world.col(0) + sin_swivel * pulley.axes_world.col(1);
  s.groove_normal = -sin_swivel * pulley.axes_world.col(0) + cos_swivel * pulley.axes_world.col(1);

  // In the groove plane, from the pulley centre: v = r n + ‖ρ‖ t. Solved for (cos ψ, sin ψ) it is
  // eq. 4 without the division by u·q, hence exact close to the swivel axis too.
  const double v_u = q_u - r;
  const double distance_squared = v_u * v_u + q_k * q_k;
  const double free_squared = q_u * q_u - 2.0 * r * q_u + q_k * q_k;
  // Beyond 1e154 m squares overflow: no numbers there, as there are none of NaN.
  if (!(free_squared <= std::numeric_limits<double>::max())) {
    return invalid_state(CableStatus::anchor_on_swivel_axis, q_u);
  }
  if (!(free_squared > 0.0)) {
    return invalid_state(CableStatus::anchor_inside_pulley, q_u);
  }
  s.free_length_m = std::sqrt(free_squared);
  const double cos_tangency = (r * v_u - s.free_length_m * q_k) / distance_squared;
  const double sin_tangency = (r * q_k + s.free_length_m * v_u) / distance_squared;
  s.tangency_rad = std::atan2(sin_tangency, cos_tangency);
  s.length_m = s.free_length_m + r * (kPi - s.tangency_rad);                        // eq. 5
  s.contact = cos_tangency * s.radial + sin_tangency * pulley.axes_world.col(2);    // eq. 1
  s.direction = sin_tangency * s.radial - cos_tangency * pulley.axes_world.col(2);  // eq. 1
  return s;
}

Matrix3 direction_by_q(const CableState& s) {
  // T of eq. A5 with sin ψ = u·t in place of ‖u × n‖: the same for ψ in (0, π), right beyond it
  // too.
  const double sin_tangency = s.radial.dot(s.direction);
  return (sin_tangency / s.radial_distance_m) * s.groove_normal * s.groove_normal.transpose() +
         (1.0 / s.free_length_m) * s.contact * s.contact.transpose();
}

CableDerivatives cable_derivatives(const Pulley& pulley, const CableState& s) {
  CableDerivatives d;
  d.length_by_q = s.direction;
  d.swivel_by_q = swivel_by_q(s);
  d.tangency_by_q = s.contact / s.free_length_m;
  d.direction_by_q = direction_by_q(s);
  const double cos_tangency = -s.direction.dot(pulley.axes_world.col(2));
  const double sin_tangency = s.radial.dot(s.direction);
  d.length_by_radius = kPi - s.tangency_rad - sin_tangency;
  d.tangency_by_radius = -(1.0 + cos_tangency) / s.free_length_m;
  d.direction_by_radius = d.tangency_by_radius * s.contact;
  return d;
}

const char* to_string(CableStatus status) {
  switch (status) {
    case CableStatus::ok:
      return "ok";
    case CableStatus::anchor_inside_pulley:
      return "the platform anchor is inside the pulley";
    case CableStatus::anchor_on_swivel_axis:
      return "the platform anchor is on the swivel axis (or at no finite place)";
  }
  return "unknown";
}

}  // namespace cdprcal
