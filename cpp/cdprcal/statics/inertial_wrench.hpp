// What it takes to accelerate the platform: what the balance of eq. 6 lacks in motion.
#pragma once

#include "cdprcal/statics/wrench.hpp"

namespace cdprcal {

/// M (6×6) of the kinetic energy ½ νᵀMν, ν = (velocity of P, angular velocity), world axes.
Matrix6 mass_matrix(const Robot& robot, const PlatformState& state);

/// M ν̇ + h(ν) about P in world axes [N, Nm], Newton and Euler about P: ν = (velocity of P, angular
/// velocity), ν̇ its derivative in world axes, h = (m ω×(ω×s), ω×I_P ω) with s from P to the centre
/// of mass. Cables pull at the platform with −Ξᵀτ (t points away from the pulley), so that in
/// motion (Ξᵀτ − f) + M ν̇ + h = 0; at rest this is eq. 6.
struct InertialWrench {
  Vector6 wrench;
  Eigen::Matrix<double, 6, 3> by_rotation;          ///< of a world-frame turn δθ, ν and ν̇ held
  Eigen::Matrix<double, 6, 3> by_angular_velocity;  ///< all of ν that h depends on
  Matrix6 mass;                                     ///< M: by ν̇
};
/// ∂ of the centre of mass' acceleration by its arm s, at constant ν and ν̇: [ω̇]× + [ω]×².
Matrix3 centre_acceleration_by_arm(const Vector6& twist, const Vector6& acceleration);
/// v̇ + ω̇ × s + ω × (ω × s) [m/s²]: times the mass, the force of M ν̇ + h(ν).
Vector3 centre_acceleration_m_s2(const Vector3& arm_m, const Vector6& twist,
                                 const Vector6& acceleration);
InertialWrench inertial_wrench(const Robot& robot, const PlatformState& state, const Vector6& twist,
                               const Vector6& acceleration);

}  // namespace cdprcal
