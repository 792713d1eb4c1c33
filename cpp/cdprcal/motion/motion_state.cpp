#include "cdprcal/motion/motion_state.hpp"

namespace cdprcal {

MotionState plus(const MotionState& state, const MotionVector& change) {
  return {plus(state.pose, change.head<6>()), state.twist + change.segment<6>(6),
          state.acceleration + change.tail<6>()};
}

MotionState moved(const MotionState& state, double dt_s) {
  return {plus(state.pose, dt_s * state.twist + 0.5 * dt_s * dt_s * state.acceleration),
          state.twist + dt_s * state.acceleration, state.acceleration};
}

MotionMatrix transition(const MotionState& state, double dt_s) {
  MotionMatrix f = MotionMatrix::Identity();
  for (int i = 0; i < 12; ++i) f(i, i + 6) = dt_s;
  for (int i = 0; i < 6; ++i) f(i, i + 12) = 0.5 * dt_s * dt_s;
  const Vector3 turn =
      dt_s * state.twist.tail<3>() + 0.5 * dt_s * dt_s * state.acceleration.tail<3>();
  const Matrix3 j = left_jacobian_so3(turn);
  f.block<3, 3>(3, 3) = exp_so3(turn).toRotationMatrix();
  f.block<3, 3>(3, 9) = dt_s * j;
  f.block<3, 3>(3, 15) = 0.5 * dt_s * dt_s * j;
  return f;
}

Matrix3 jerk_covariance(double dt_s) {
  const double t2 = dt_s * dt_s, t3 = t2 * dt_s;
  Matrix3 q;
  q << t3 * t2 / 20.0, t2 * t2 / 8.0, t3 / 6.0,  //
      t2 * t2 / 8.0, t3 / 3.0, t2 / 2.0,         //
      t3 / 6.0, t2 / 2.0, dt_s;
  return q;
}

}  // namespace cdprcal
