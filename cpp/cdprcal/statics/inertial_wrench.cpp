#include "cdprcal/statics/inertial_wrench.hpp"

namespace cdprcal {

Matrix6 mass_matrix(const Robot& robot, const PlatformState& state) {
  const double m = robot.platform.mass_kg;
  const Matrix3 arm = skew(state.centre_of_mass_arm_m);
  Matrix6 mass;
  // Steiner's theorem takes the inertia from the centre of mass to P.
  mass << m * Matrix3::Identity(), -m * arm, m * arm,
      state.rotation * robot.platform.inertia_kg_m2 * state.rotation.transpose() - m * arm * arm;
  return mass;
}

Matrix3 centre_acceleration_by_arm(const Vector6& twist, const Vector6& acceleration) {
  const Matrix3 turning = skew(twist.tail<3>());
  return skew(acceleration.tail<3>()) + turning * turning;
}

Vector3 centre_acceleration_m_s2(const Vector3& arm_m, const Vector6& twist,
                                 const Vector6& acceleration) {
  return acceleration.head<3>() + centre_acceleration_by_arm(twist, acceleration) * arm_m;
}

InertialWrench inertial_wrench(const Robot& robot, const PlatformState& state, const Vector6& twist,
                               const Vector6& acceleration) {
  InertialWrench out;
  out.mass = mass_matrix(robot, state);
  const double m = robot.platform.mass_kg;
  const Vector3 s = state.centre_of_mass_arm_m;
  const Vector3 w = twist.tail<3>();
  const Matrix3 inertia = out.mass.bottomRightCorner<3, 3>();
  const Vector3 iw = inertia * w;
  Vector6 h;
  h << m * w.cross(w.cross(s)), w.cross(iw);
  out.wrench = out.mass * acceleration + h;
  // ω×(ω×s) = ω(ω·s) − s ω²
  out.by_angular_velocity.topRows<3>() =
      m * (w.dot(s) * Matrix3::Identity() + w * s.transpose() - 2.0 * s * w.transpose());
  out.by_angular_velocity.bottomRows<3>() = skew(w) * inertia - skew(iw);
  // A turn of all (robot, ν and ν̇) turns the wrench: [δθ]× of it. Less what turning ν and ν̇ does.
  Eigen::Matrix<double, 6, 3> turned;
  turned << skew(acceleration.head<3>()), skew(acceleration.tail<3>());
  out.by_rotation = out.mass * turned + out.by_angular_velocity * skew(w);
  out.by_rotation.topRows<3>() -= skew(out.wrench.head<3>());
  out.by_rotation.bottomRows<3>() -= skew(out.wrench.tail<3>());
  return out;
}

}  // namespace cdprcal
