#include "cdprcal/kinematics/cable.hpp"

#include "cdprcal/kinematics/cable_equations.hpp"

namespace cdprcal {

namespace {

/// No number of a state without a tangent may pass for a result.
CableState invalid_state(CableStatus status, double radial_distance_m) {
  const Vector3 none = Vector3::Constant(kNaN);
  return {status, kNaN, kNaN, kNaN, kNaN, radial_distance_m, none, none, none, none};
}

Vector3 vector(const lanes::Triple<double>& triple) { return {triple.x, triple.y, triple.z}; }

}  // namespace

CableState cable_state(const Pulley& pulley, const Vector3& q_world_m) {
  const CableEquations<double> s =
      cable_equations<lanes::One>(pulley, {q_world_m.x(), q_world_m.y(), q_world_m.z()});
  if (!s.is_tangent()) {
    const bool inside = s.radial_distance_m > 0.0 && s.free_squared_m2 <= 0.0;
    return invalid_state(
        inside ? CableStatus::anchor_inside_pulley : CableStatus::anchor_on_swivel_axis,
        s.radial_distance_m);
  }
  return {CableStatus::ok,   s.length_m,          s.swivel_rad,     s.tangency_rad,
          s.free_length_m,   s.radial_distance_m, vector(s.radial), vector(s.groove_normal),
          vector(s.contact), vector(s.direction)};
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
