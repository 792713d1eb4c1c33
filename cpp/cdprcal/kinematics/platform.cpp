#include "cdprcal/kinematics/platform.hpp"

#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

using Row6 = Eigen::Matrix<double, 1, 6>;

/// Chain rule through q: for a scalar with ∂/∂q = gradient, its derivative along a twist.
inline Row6 by_twist(const Vector3& gradient, const Vector3& arm) {
  Row6 row;
  row << gradient.transpose(), arm.cross(gradient).transpose();
  return row;
}

}  // namespace

CableVector PlatformState::length_m() const {
  CableVector values(cable_count);
  for (int i = 0; i < cable_count; ++i) values[i] = cable[i].length_m;
  return values;
}

CableVector PlatformState::swivel_rad() const {
  CableVector values(cable_count);
  for (int i = 0; i < cable_count; ++i) values[i] = cable[i].swivel_rad;
  return values;
}

PlatformState platform_state(const Robot& robot, const Pose& pose) {
  PlatformState state;
  state.cable_count = robot.cable_count();
  if (state.cable_count > kMaxCables) [[unlikely]] {
    throw InputError("robot: cables: has " + std::to_string(state.cable_count) +
                     ", there is room for " + std::to_string(kMaxCables) + "; give no more");
  }
  state.rotation = pose.rotation_matrix();
  state.centre_of_mass_arm_m = state.rotation * robot.platform.centre_of_mass_m;
  state.valid = true;
  for (int i = 0; i < state.cable_count; ++i) {
    const Cable& cable = robot.cables[i];
    state.anchor_arm_m[i] = state.rotation * cable.platform_anchor_m;
    const Vector3 q = pose.position_m + state.anchor_arm_m[i] - cable.pulley.position_m;
    state.cable[i] = cable_state(cable.pulley, q);
    state.valid = state.valid && state.cable[i].status == CableStatus::ok;
  }
  return state;
}

CableJacobian length_jacobian(const PlatformState& state) {
  CableJacobian jacobian(state.cable_count, 6);
  for (int i = 0; i < state.cable_count; ++i) {
    jacobian.row(i) = by_twist(state.cable[i].direction, state.anchor_arm_m[i]);
  }
  return jacobian;
}

CableJacobian swivel_jacobian(const PlatformState& state) {
  CableJacobian jacobian(state.cable_count, 6);
  for (int i = 0; i < state.cable_count; ++i) {
    jacobian.row(i) = by_twist(swivel_by_q(state.cable[i]), state.anchor_arm_m[i]);
  }
  return jacobian;
}

std::string describe_invalid(const PlatformState& state) {
  for (int i = 0; i < state.cable_count; ++i) {
    if (state.cable[i].status != CableStatus::ok) {
      return "cable " + std::to_string(i + 1) + ": " + to_string(state.cable[i].status);
    }
  }
  return {};
}

}  // namespace cdprcal
