#include "cdprcal/motion/inertial_readings.hpp"

#include "cdprcal/statics/inertial_wrench.hpp"

namespace cdprcal {

std::vector<RowLabel> inertial_rows() {
  std::vector<RowLabel> rows;
  for (const Channel channel : {Channel::specific_force, Channel::angular_velocity}) {
    for (int axis = 0; axis < 3; ++axis) rows.push_back({channel, axis});
  }
  return rows;
}

void evaluate(const Robot& robot, const Measurement& m, const MotionState& state,
              InertialReadings& out) {
  out.by_state.setZero();
  const Matrix3 to_platform = state.pose.rotation_matrix().transpose();
  const Vector3 rate = state.twist.tail<3>();
  const Vector3 place_m = robot.platform.inertial_unit_m.value_or(Vector3::Constant(kNaN));
  const Vector3 arm = to_platform.transpose() * place_m;
  const Vector3 felt = centre_acceleration_m_s2(arm, state.twist, state.acceleration) +
                       Vector3(0.0, 0.0, robot.gravity_m_s2);
  const Matrix3 by_arm = centre_acceleration_by_arm(state.twist, state.acceleration);
  out.misfit << to_platform * felt - m.specific_force_m_s2,
      to_platform * rate - m.angular_velocity_rad_s;
  out.by_state.block<3, 3>(0, 3) = to_platform * (skew(felt) - by_arm * skew(arm));
  out.by_state.block<3, 3>(0, 9) = -to_platform * (skew(rate.cross(arm)) + skew(rate) * skew(arm));
  out.by_state.block<3, 3>(0, 12) = to_platform;
  out.by_state.block<3, 3>(0, 15) = -to_platform * skew(arm);
  out.by_state.block<3, 3>(3, 3) = to_platform * skew(rate);
  out.by_state.block<3, 3>(3, 9) = to_platform;
}

}  // namespace cdprcal
