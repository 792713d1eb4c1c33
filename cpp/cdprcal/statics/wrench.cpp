#include "cdprcal/statics/wrench.hpp"

#include <algorithm>

#include "cdprcal/singular_values.hpp"
#include "cdprcal/statics/one_a_cable.hpp"

namespace cdprcal {

WrenchMatrix structure_matrix(const PlatformState& state) {
  return length_jacobian(state).transpose();
}

Vector6 gravity_wrench(const Robot& robot, const PlatformState& state) {
  const Vector3 g = robot.gravity_force_N();
  Vector6 wrench;
  wrench << g, state.centre_of_mass_arm_m.cross(g);
  return wrench;
}

Vector6 wrench_residual(const Robot& robot, const PlatformState& state,
                        const CableVector& tension_N) {
  require_one_a_cable(tension_N, state.cable_count);
  return structure_matrix(state) * tension_N - gravity_wrench(robot, state);
}

Matrix6 tension_stiffness(const PlatformState& state, const CableVector& tension_N) {
  require_one_a_cable(tension_N, state.cable_count);
  // Eq. A5 has [T, −T ã; ã T, t̃ ã − ã T ã]. T is (sin ψ / u·q) w wᵀ + n nᵀ/‖ρ‖, so all but t̃ ã are
  // two outer products of (v, a × v).
  Matrix6 k = Matrix6::Zero();
  for (int i = 0; i < state.cable_count; ++i) {
    const CableState& cable = state.cable[i];
    const Vector3& arm = state.anchor_arm_m[i];
    Vector6 swivel, tangency;
    swivel << cable.groove_normal, arm.cross(cable.groove_normal);
    tangency << cable.contact, arm.cross(cable.contact);
    const double sin_tangency = cable.radial.dot(cable.direction);
    const Vector6 by_swivel = (tension_N[i] * sin_tangency / cable.radial_distance_m) * swivel;
    const Vector6 by_tangency = (tension_N[i] / cable.free_length_m) * tangency;
    k += by_swivel * swivel.transpose() + by_tangency * tangency.transpose();
    const Vector3 pull = tension_N[i] * cable.direction;
    k.bottomRightCorner<3, 3>() += arm * pull.transpose();  // t̃ ã = a tᵀ − (t·a) 1
    k.bottomRightCorner<3, 3>().diagonal().array() -= pull.dot(arm);
  }
  return k;
}

Matrix6 gravity_stiffness(const Robot& robot, const PlatformState& state) {
  Matrix6 q = Matrix6::Zero();
  q.bottomRightCorner<3, 3>() = -skew(robot.gravity_force_N()) * skew(state.centre_of_mass_arm_m);
  return q;
}

Matrix6 stiffness(const Robot& robot, const PlatformState& state, const CableVector& tension_N) {
  return tension_stiffness(state, tension_N) + gravity_stiffness(robot, state);
}

Eigen::MatrixXd free_motion_basis(const PlatformState& state) {
  if (!state.valid) {  // a decomposition of NaN would return memory that nobody wrote
    return Eigen::MatrixXd::Constant(6, std::max(0, 6 - state.cable_count), kNaN);
  }
  const Svd parts = svd(Eigen::MatrixXd(length_jacobian(state)));
  return parts.v.rightCols(6 - parts.rank);
}

Eigen::MatrixXd free_motion_stiffness(const Robot& robot, const PlatformState& state,
                                      const CableVector& tension_N) {
  const Eigen::MatrixXd basis = free_motion_basis(state);
  const Eigen::MatrixXd k = basis.transpose() * stiffness(robot, state, tension_N) * basis;
  return 0.5 * (k + k.transpose());
}

double potential_energy(const Robot& robot, const Pose& pose, const PlatformState& state,
                        const CableVector& tension_N) {
  require_one_a_cable(tension_N, state.cable_count);
  const double height = pose.position_m.z() + state.centre_of_mass_arm_m.z();
  return tension_N.dot(state.length_m()) + robot.weight_N() * height;
}

}  // namespace cdprcal
