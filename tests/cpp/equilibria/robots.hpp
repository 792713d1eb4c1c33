// Robots and transformations that the equilibrium and workspace tests share.
#pragma once

#include <array>

#include "../support/random_robot.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/statics/wrench.hpp"

namespace cdprcal::test {

inline Robot irma4() { return load_robot("irma4"); }

/// irma4 with its pulleys at exactly mirrored places (the real ones are 1 mm off).
inline Robot symmetric_irma4() {
  Robot robot = irma4();
  for (Cable& cable : robot.cables) {
    Vector3& d = cable.pulley.position_m;
    d.x() = std::copysign(1.0655, d.x());
  }
  return robot;
}

/// irma4 without its last cable, or with a fifth one between cables 1 and 2.
inline Robot irma4_with_cables(int count) {
  Robot robot = irma4();
  if (count == 3) robot.cables.pop_back();
  if (count == 5) {
    Cable fifth = robot.cables[0];
    fifth.pulley.position_m = {1.3, 0.1, 1.9};
    fifth.platform_anchor_m = {0.1, 0.0, 0.2};
    robot.cables.push_back(fifth);
  }
  return robot;
}

/// The whole installation turned about the vertical through the world's origin.
inline Robot turned(const Robot& robot, double angle_rad) {
  const Matrix3 turn = exp_so3(angle_rad * Vector3::UnitZ()).toRotationMatrix();
  Robot result = robot;
  for (Cable& cable : result.cables) {
    cable.pulley.position_m = turn * cable.pulley.position_m;
    cable.pulley.axes_world = turn * cable.pulley.axes_world;
  }
  return result;
}

inline Pose turned(const Pose& pose, double angle_rad) {
  const Eigen::Quaterniond turn = exp_so3(angle_rad * Vector3::UnitZ());
  return {turn * pose.position_m, (turn * pose.rotation).normalized()};
}

/// A mirror of irma4 (axis 0: x ↔ −x): the pose, and the order in which the cables reappear.
inline Pose mirrored(const Pose& pose, int axis) {
  Matrix3 mirror = Matrix3::Identity();
  mirror(axis, axis) = -1.0;
  return {mirror * pose.position_m,
          Eigen::Quaterniond(Matrix3(mirror * pose.rotation_matrix() * mirror))};
}
inline CableVector mirrored(const CableVector& values, int axis) {
  const std::array<int, 4> order = axis == 0 ? std::array{3, 2, 1, 0} : std::array{1, 0, 3, 2};
  CableVector result(4);
  for (int i = 0; i < 4; ++i) result[i] = values[order[i]];
  return result;
}

/// Tensions that more than carry the weight, no cable much stronger than the others.
inline CableVector carrying_tensions(Rng& rng, const Robot& robot) {
  CableVector tension(robot.cable_count());
  for (double& t : tension) t = uniform(rng, 0.4, 1.0);
  return tension * (uniform(rng, 1.3, 2.5) * robot.weight_N() / tension.sum());
}

/// ‖Ξᵀτ − f‖ without any of the code under test.
inline double imbalance(const Robot& robot, const Pose& pose, const CableVector& tension_N) {
  return wrench_residual(robot, platform_state(robot, pose), tension_N).norm();
}

inline double distance(const Pose& a, const Pose& b) { return minus(a, b).norm(); }

}  // namespace cdprcal::test
