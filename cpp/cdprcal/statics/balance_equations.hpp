// Private to the library: eq. 6 and its derivative (eq. A5), for poses side by side.
#pragma once

#include "cdprcal/lanes/algebra.hpp"

namespace cdprcal {

/// (v, a × v): derivative along a twist of what has gradient v at an arm a.
template <typename V>
struct Twist {
  lanes::Triple<V> linear, angular;
  CDPRCAL_INLINE V operator[](int i) const {
    return i < 3 ? part(linear, i) : part(angular, i - 3);
  }
  static CDPRCAL_INLINE V part(const lanes::Triple<V>& t, int i) {
    return i == 0 ? t.x : i == 1 ? t.y : t.z;
  }
};
template <typename V>
CDPRCAL_INLINE Twist<V> twist_of(const lanes::Triple<V>& gradient, const lanes::Triple<V>& arm) {
  return {gradient, cross(arm, gradient)};
}
template <typename V>
CDPRCAL_INLINE Twist<V> operator*(const V& factor, const Twist<V>& twist) {
  return {factor * twist.linear, factor * twist.angular};
}

/// What the statics need of a cable: eq. A5 is a sum of two outer products (tension_stiffness).
template <typename V>
struct CableStatics {
  lanes::Triple<V> arm, direction;
  Twist<V> pull, swivel, tangency;
  V by_swivel, by_tangency;  ///< stiffness a newton
};

/// ∂(Ξᵀτ − f) along a twist at constant tensions, and its parts.
template <typename V>
struct Stiffness {
  V k[6][6] = {};
  CDPRCAL_INLINE void add_lower(const Twist<V>& t, const V& factor) {
    for (int i = 0; i < 6; ++i) {
      const V scaled = factor * t[i];
      for (int j = 0; j <= i; ++j) k[i][j] += scaled * t[j];
    }
  }
  CDPRCAL_INLINE void mirror() {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < i; ++j) k[j][i] = k[i][j];
    }
  }
  /// ∂(a × f) for a force f at an arm a: a fᵀ − (f·a) 1.
  CDPRCAL_INLINE void add_force(const lanes::Triple<V>& arm, const lanes::Triple<V>& force) {
    const V work = dot(arm, force);
    const V a[3] = {arm.x, arm.y, arm.z}, f[3] = {force.x, force.y, force.z};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) k[3 + i][3 + j] += a[i] * f[j];
      k[3 + i][3 + i] -= work;
    }
  }
};

/// Stiffness and balance at tensions τ.
template <typename V>
CDPRCAL_INLINE void balance_of(const CableStatics<V>* cable, int cables, const V* tension_N,
                               const lanes::Triple<V>& gravity_N,
                               const lanes::Triple<V>& mass_arm_m, V (&wrench)[6],
                               Stiffness<V>& stiffness) {
  for (int i = 0; i < 6; ++i) wrench[i] = V{};
  for (int i = 0; i < cables; ++i) {
    const CableStatics<V>& c = cable[i];
    for (int a = 0; a < 6; ++a) wrench[a] += tension_N[i] * c.pull[a];
    stiffness.add_lower(c.swivel, tension_N[i] * c.by_swivel);
    stiffness.add_lower(c.tangency, tension_N[i] * c.by_tangency);
  }
  stiffness.mirror();
  for (int i = 0; i < cables; ++i) {
    stiffness.add_force(cable[i].arm, tension_N[i] * cable[i].direction);
  }
  const Twist<V> weight = twist_of(gravity_N, mass_arm_m);
  for (int a = 0; a < 6; ++a) wrench[a] -= weight[a];
  stiffness.add_force(mass_arm_m, V(V{} - 1.0) * gravity_N);
}

}  // namespace cdprcal
