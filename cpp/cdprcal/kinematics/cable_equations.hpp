// Private to the library: eqs 1–5 of one cable, for one pose or for several side by side.
#pragma once

#include "cdprcal/lanes/algebra.hpp"
#include "cdprcal/model/robot.hpp"

namespace cdprcal {

/// The numbers of CableState. They mean something where is_tangent() holds.
template <typename V>
struct CableEquations {
  V radial_distance_m, free_squared_m2, free_length_m;
  V swivel_rad, tangency_rad, length_m;
  V sin_tangency;
  lanes::Triple<V> radial, groove_normal, contact, direction;

  /// Whether the anchor is off the swivel axis and outside the pulley, and squares do not overflow
  /// (beyond 1e154 m; NaN neither).
  [[nodiscard]] CDPRCAL_INLINE auto is_tangent() const {
    return (radial_distance_m > V{}) & (free_squared_m2 > V{}) & lanes::finite(free_squared_m2);
  }
};

template <typename Kind, typename V = typename Kind::V>
CDPRCAL_INLINE CableEquations<V> cable_equations(const Pulley& pulley,
                                                 const lanes::Triple<V>& q_world_m) {
  using lanes::along;
  const double r = pulley.radius_m;
  const Vector3 i = pulley.axes_world.col(0), j = pulley.axes_world.col(1),
                k = pulley.axes_world.col(2);
  CableEquations<V> s;
  const V q_i = dot(i, q_world_m), q_j = dot(j, q_world_m), q_k = dot(k, q_world_m);
  const V q_u = Kind::sqrt(q_i * q_i + q_j * q_j);
  s.radial_distance_m = q_u;
  const V cos_swivel = q_i / q_u;
  const V sin_swivel = q_j / q_u;
  s.swivel_rad = Kind::atan2(q_j, q_i);  // eq. 2
  s.radial = along(cos_swivel, i) + along(sin_swivel, j);
  s.groove_normal = along(-sin_swivel, i) + along(cos_swivel, j);

  // In the groove plane, from the pulley centre: v = r n + ‖ρ‖ t. Solved for (cos ψ, sin ψ) it is
  // eq. 4 without the division by u·q, hence exact close to the swivel axis too.
  const V v_u = q_u - r;
  const V distance_squared = v_u * v_u + q_k * q_k;
  s.free_squared_m2 = q_u * q_u - 2.0 * r * q_u + q_k * q_k;
  s.free_length_m = Kind::sqrt(s.free_squared_m2);
  const V cos_tangency = (r * v_u - s.free_length_m * q_k) / distance_squared;
  s.sin_tangency = (r * q_k + s.free_length_m * v_u) / distance_squared;
  s.tangency_rad = Kind::atan2(s.sin_tangency, cos_tangency);
  s.length_m = s.free_length_m + r * (kPi - s.tangency_rad);             // eq. 5
  s.contact = cos_tangency * s.radial + along(s.sin_tangency, k);        // eq. 1
  s.direction = s.sin_tangency * s.radial + along(V(-cos_tangency), k);  // eq. 1
  return s;
}

}  // namespace cdprcal
