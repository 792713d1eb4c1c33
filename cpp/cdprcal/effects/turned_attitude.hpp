// Private to effects/: an AHRS that reads another attitude than the platform's.
#pragma once

#include "cdprcal/effects/effect.hpp"

namespace cdprcal {

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
