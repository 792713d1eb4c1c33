// Private to effects/: how a rotation vector moves its rotation.
#pragma once

#include <cmath>

#include "cdprcal/geometry/pose.hpp"

namespace cdprcal {

/// J of exp(rho + drho) = exp(J drho) exp(rho): the left Jacobian of SO(3) (Barfoot, State
/// Estimation for Robotics, eq. 7.77).
inline Matrix3 left_jacobian(const Vector3& rotation_rad) {
  const double angle = rotation_rad.norm();
  const Matrix3 axis = skew(rotation_rad);
  const double a = angle > 1e-4 ? (1.0 - std::cos(angle)) / (angle * angle) : 0.5;
  const double b = angle > 1e-4 ? (angle - std::sin(angle)) / (angle * angle * angle) : 1.0 / 6.0;
  return Matrix3::Identity() + a * axis + b * axis * axis;
}

}  // namespace cdprcal
