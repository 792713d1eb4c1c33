#include "cdprcal/effects/pose_evaluation.hpp"

#include <Eigen/LU>

#include "cdprcal/effects/effect.hpp"
#include "cdprcal/statics/inertial_wrench.hpp"

namespace cdprcal {

void add_inertia(const Robot& robot, const PlatformState& state, const Measurement& measurement,
                 PoseEvaluation& out) {
  if (!measurement.moves()) return;
  const InertialWrench inertial =
      inertial_wrench(robot, state, measurement.twist, measurement.acceleration);
  out.wrench += inertial.wrench + measurement.excess_wrench;
  out.wrench_by_twist.rightCols<3>() += inertial.by_rotation;
}

void evaluate_geometry(const Robot& robot, const PlatformState& state, const Pose& pose,
                       bool with_jacobians, PoseEvaluation& out) {
  out.valid = state.valid && pose.position_m.allFinite();
  if (!out.valid) return;
  out.length_m = state.length_m();
  out.swivel_rad = state.swivel_rad();
  out.roll_pitch_yaw_rad = euler_from_rotation(state.rotation, robot.euler_convention);
  out.direct_length_m = out.length_m;
  out.absolute_yaw_rad = out.roll_pitch_yaw_rad[2];
  out.position_m = pose.position_m;
  const Vector3 up{0.0, 0.0, robot.gravity_m_s2};
  out.specific_force_m_s2 = state.rotation.transpose() * up;  // at rest
  out.angular_velocity_rad_s.setZero();
  if (!with_jacobians) return;
  out.length_by_twist = length_jacobian(state);
  out.swivel_by_twist = swivel_jacobian(state);
  out.attitude_by_twist.leftCols<3>().setZero();
  out.attitude_by_twist.rightCols<3>() =
      euler_rate_matrix(out.roll_pitch_yaw_rad, robot.euler_convention).inverse();
  out.valid = out.attitude_by_twist.allFinite();  // gimbal lock
  out.absolute_by_twist.direct_length_m = out.length_by_twist;
  out.absolute_by_twist.absolute_yaw_rad = out.attitude_by_twist.row(2);
  out.absolute_by_twist.position_m.setIdentity();
  out.absolute_by_twist.specific_force_m_s2 << Matrix3::Zero(),
      state.rotation.transpose() * skew(up);
  out.absolute_by_twist.angular_velocity_rad_s.setZero();
}

void evaluate_pose(const Robot& robot, const Measurement& measurement, const Pose& pose,
                   StaticsModel statics, const std::vector<WrenchRow>& left_inverse_rows,
                   const std::vector<ActiveEffect>& effects, bool with_jacobians,
                   PoseEvaluation& out) {
  const PlatformState state = platform_state(robot, pose);
  const bool jacobians = with_jacobians || !effects.empty();
  evaluate_geometry(robot, state, pose, jacobians, out);
  if (!out.valid) return;
  const EffectContext context{robot, state, pose, measurement};
  if (statics == StaticsModel::left_inverse) {
    const TensionModel model = tensions_left_inverse(robot, state, left_inverse_rows);
    out.valid = out.valid && model.valid;
    if (!out.valid) return;
    out.tension_N = model.tension_N;
    if (!effects.empty()) {  // what the load cells would read of these
      out.tension_N +=
          measurement.tension_N - corrected_tension_N(context, effects, measurement.tension_N);
    }
    out.tension_by_twist = model.by_twist;
  } else if (statics == StaticsModel::wrench) {
    out.tension_N = corrected_tension_N(context, effects, measurement.tension_N);
    out.wrench = wrench_residual(robot, state, out.tension_N);
    if (jacobians) out.wrench_by_twist = stiffness(robot, state, out.tension_N);
    add_inertia(robot, state, measurement, out);
  }
  for (const ActiveEffect& active : effects) {
    active.effect->add_to_readings(context, active.values, out);
  }
}

}  // namespace cdprcal
