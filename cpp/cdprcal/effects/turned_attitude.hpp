// Private to effects/: an AHRS that reads another attitude than the platform's.
#pragma once

#include <cmath>

#include "cdprcal/effects/effect.hpp"

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

/// The platform's attitude R is read as `level` · R · `mounting`: adds what that does to the angles
/// and to their derivatives by a world-frame turn, of which the mounting makes none.
inline void turn_attitude(const EffectContext& context, const Matrix3& level,
                          const Matrix3& mounting, PoseEvaluation& evaluation) {
  const EulerConvention convention = context.robot.euler_convention;
  const Vector3 plain = euler_from_rotation(context.state.rotation, convention);
  const Vector3 angles = euler_from_rotation(level * context.state.rotation * mounting, convention);
  for (int a = 0; a < 3; ++a) {
    evaluation.roll_pitch_yaw_rad[a] += wrap_angle(angles[a] - plain[a]);
  }
  evaluation.attitude_by_twist.rightCols<3>() +=
      euler_rate_matrix(angles, convention).inverse() * level -
      euler_rate_matrix(plain, convention).inverse();
}

}  // namespace cdprcal
