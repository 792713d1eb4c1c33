// A box along the axes of the world.
#pragma once

#include <cmath>

#include "cdprcal/types.hpp"

namespace cdprcal {

/// Axis-aligned box [m], world axes.
struct Box {
  Vector3 lower_m = Vector3::Zero();
  Vector3 upper_m = Vector3::Zero();

  /// Around nothing, to be filled by `include`.
  static Box empty() { return {Vector3::Constant(HUGE_VAL), Vector3::Constant(-HUGE_VAL)}; }
  /// Grows to hold a point, too.
  void include(const Vector3& p) {
    lower_m = lower_m.cwiseMin(p);
    upper_m = upper_m.cwiseMax(p);
  }
  [[nodiscard]] Vector3 extent_m() const { return upper_m - lower_m; }
  [[nodiscard]] bool contains(const Vector3& p, double tolerance_m = 0.0) const {
    return ((p - lower_m).array() >= -tolerance_m).all() &&
           ((upper_m - p).array() >= -tolerance_m).all();
  }
  [[nodiscard]] double volume_m3() const { return extent_m().prod(); }
};

}  // namespace cdprcal
