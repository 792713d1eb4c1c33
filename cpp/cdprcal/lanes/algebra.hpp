// Private to the library: small vectors and matrices of lanes.
#pragma once

#include "cdprcal/lanes/vectors.hpp"

namespace cdprcal::lanes {

template <typename V>
struct Triple {
  V x, y, z;
};

template <typename V>
CDPRCAL_INLINE V dot(const Triple<V>& a, const Triple<V>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <typename V>
CDPRCAL_INLINE V dot(const Vector3& a, const Triple<V>& b) {
  return a.x() * b.x + a.y() * b.y + a.z() * b.z;
}
template <typename V>
CDPRCAL_INLINE Triple<V> cross(const Triple<V>& a, const Triple<V>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <typename V>
CDPRCAL_INLINE Triple<V> operator+(const Triple<V>& a, const Triple<V>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <typename V>
CDPRCAL_INLINE Triple<V> operator*(const V& a, const Triple<V>& b) {
  return {a * b.x, a * b.y, a * b.z};
}
/// a · axis
template <typename V>
CDPRCAL_INLINE Triple<V> along(const V& a, const Vector3& axis) {
  return {a * axis.x(), a * axis.y(), a * axis.z()};
}

/// R of the quaternion x y z w at `pose`[3…6].
template <typename V>
CDPRCAL_INLINE void rotation_matrix(const Lanes<V>& pose, V (&r)[3][3]) {
  const V x = pose[3], y = pose[4], z = pose[5], w = pose[6];
  const V tx = 2.0 * x, ty = 2.0 * y, tz = 2.0 * z;
  r[0][0] = 1.0 - (ty * y + tz * z);
  r[0][1] = tx * y - tz * w;
  r[0][2] = tx * z + ty * w;
  r[1][0] = tx * y + tz * w;
  r[1][1] = 1.0 - (tx * x + tz * z);
  r[1][2] = ty * z - tx * w;
  r[2][0] = tx * z - ty * w;
  r[2][1] = ty * z + tx * w;
  r[2][2] = 1.0 - (tx * x + ty * y);
}
template <typename V>
CDPRCAL_INLINE Triple<V> rotate(const V (&r)[3][3], const Vector3& v) {
  return {r[0][0] * v.x() + r[0][1] * v.y() + r[0][2] * v.z(),
          r[1][0] * v.x() + r[1][1] * v.y() + r[1][2] * v.z(),
          r[2][0] * v.x() + r[2][1] * v.y() + r[2][2] * v.z()};
}

/// Where a lower triangle keeps a number: row after row.
constexpr int packed(int row, int column) { return row * (row + 1) / 2 + column; }

/// h, a packed lower triangle of six rows ← L with h = L Lᵀ, its diagonal inverted. NaN where h is
/// not positive definite.
template <typename Kind, typename V = typename Kind::V>
CDPRCAL_INLINE void cholesky(V* h) {
  for (int j = 0; j < 6; ++j) {
    V pivot = h[packed(j, j)];
    for (int k = 0; k < j; ++k) pivot -= h[packed(j, k)] * h[packed(j, k)];
    const V inverse = 1.0 / Kind::sqrt(pivot);
    h[packed(j, j)] = inverse;
    for (int i = j + 1; i < 6; ++i) {
      V value = h[packed(i, j)];
      for (int k = 0; k < j; ++k) value -= h[packed(i, k)] * h[packed(j, k)];
      h[packed(i, j)] = value * inverse;
    }
  }
}

/// v ← L⁻¹ v, where h holds L with its diagonal inverted.
template <typename V>
CDPRCAL_INLINE void forward(const V* h, V* v) {
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b < a; ++b) v[a] -= h[packed(a, b)] * v[b];
    v[a] *= h[packed(a, a)];
  }
}

/// Inverse by Gauss–Jordan with pivots of each lane's own. Returns ‖A‖₁ ‖A⁻¹‖₁.
template <typename V>
CDPRCAL_INLINE V invert(int n, const V (&matrix)[6][6], V (&inverse)[6][6]) {
  V a[6][12];
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      a[i][j] = matrix[i][j];
      a[i][n + j] = V{} + (i == j ? 1.0 : 0.0);
    }
  }
  const auto magnitude = [](const V& v) CDPRCAL_INLINE_LAMBDA { return v < V{} ? -v : v; };
  for (int k = 0; k < n; ++k) {
    for (int i = k + 1; i < n; ++i) {
      const auto larger = magnitude(a[i][k]) > magnitude(a[k][k]);
      for (int j = k; j < 2 * n; ++j) {
        const V upper = a[k][j], lower = a[i][j];
        a[k][j] = larger ? lower : upper;
        a[i][j] = larger ? upper : lower;
      }
    }
    const V scale = 1.0 / a[k][k];
    for (int j = k; j < 2 * n; ++j) a[k][j] *= scale;
    for (int i = 0; i < n; ++i) {
      if (i == k) continue;
      const V factor = a[i][k];
      for (int j = k; j < 2 * n; ++j) a[i][j] -= factor * a[k][j];
    }
  }
  V largest = {}, largest_inverse = {};
  for (int j = 0; j < n; ++j) {
    V sum = {}, sum_inverse = {};
    for (int i = 0; i < n; ++i) {
      inverse[i][j] = a[i][n + j];
      sum += magnitude(matrix[i][j]);
      sum_inverse += magnitude(inverse[i][j]);
    }
    largest = sum > largest ? sum : largest;
    largest_inverse = sum_inverse > largest_inverse ? sum_inverse : largest_inverse;
  }
  return largest * largest_inverse;
}

}  // namespace cdprcal::lanes
