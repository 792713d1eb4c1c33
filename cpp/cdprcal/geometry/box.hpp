// A box along the axes of the world.
#pragma once

#include "cdprcal/types.hpp"

namespace cdprcal {

/// Axis-aligned box [m], world axes.
struct Box {
  Vector3 lower_m = Vector3::Zero();
  Vector3 upper_m = Vector3::Zero();

  [[nodiscard]] bool contains(const Vector3& p, double tolerance_m = 0.0) const {
    return ((p - lower_m).array() >= -tolerance_m).all() &&
           ((upper_m - p).array() >= -tolerance_m).all();
  }
  [[nodiscard]] double volume_m3() const { return (upper_m - lower_m).prod(); }
};

}  // namespace cdprcal
