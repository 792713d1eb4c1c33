// Private to the library: Tait–Bryan angles of rotations side by side, away from gimbal lock.
#pragma once

#include "cdprcal/geometry/euler.hpp"
#include "cdprcal/lanes/vectors.hpp"

namespace cdprcal {

/// Angles, and how they turn: what euler_from_rotation and euler_rate_derivative say of one.
template <typename V>
struct Attitude {
  int a, b, c;  ///< first, second, third axis
  V angle[3];
  V axis[3][3];      ///< [angle][world axis]: column of H
  V by_omega[3][3];  ///< [angle][world axis]: H⁻¹
  V cos_middle;
};
template <typename Kind, typename V = typename Kind::V>
CDPRCAL_INLINE void attitude_of(const V (&r)[3][3], EulerConvention convention, Attitude<V>& out) {
  const std::array<int, 3> axes = euler_axes(convention);
  const int a = axes[0], b = axes[1], c = axes[2];
  out.a = a, out.b = b, out.c = c;
  const double sign = (b - a + 3) % 3 == 1 ? 1.0 : -1.0;
  out.cos_middle = Kind::sqrt(r[a][a] * r[a][a] + r[a][b] * r[a][b]);
  const V scale = 1.0 / Kind::sqrt(r[b][c] * r[b][c] + r[c][c] * r[c][c]);
  const V cos_first = r[c][c] * scale, sin_first = -r[b][c] * scale;
  out.angle[a] = Kind::atan2(V(sign * sin_first), cos_first);
  out.angle[b] = Kind::atan2(V(sign * r[a][c]), out.cos_middle);
  out.angle[c] = Kind::atan2(V(sign * (cos_first * r[b][a] + sin_first * r[c][a])),
                             V(cos_first * r[b][b] + sin_first * r[c][b]));
  const V none = {}, one = V{} + 1.0;
  out.axis[a][a] = one, out.axis[a][b] = none, out.axis[a][c] = none;
  out.axis[b][a] = none, out.axis[b][b] = cos_first, out.axis[b][c] = sin_first;
  for (int i = 0; i < 3; ++i) out.axis[c][i] = r[i][c];
  const V per_cos = 1.0 / out.cos_middle;
  const V sin_part = sin_first * per_cos, cos_part = cos_first * per_cos;
  out.by_omega[a][a] = one;
  out.by_omega[a][b] = r[a][c] * sin_part;
  out.by_omega[a][c] = -r[a][c] * cos_part;
  out.by_omega[b][a] = none, out.by_omega[b][b] = cos_first, out.by_omega[b][c] = sin_first;
  out.by_omega[c][a] = none, out.by_omega[c][b] = -sin_part, out.by_omega[c][c] = cos_part;
}

}  // namespace cdprcal
