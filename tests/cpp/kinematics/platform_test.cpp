#include "cdprcal/kinematics/platform.hpp"

#include <gtest/gtest.h>

#include "../support/numeric_jacobian.hpp"
#include "../support/random_robot.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal {
namespace {

using test::derivative_cases;
using test::jacobian_matches;
using test::numeric_pose_jacobian;
using test::Rng;

TEST(Platform, LengthJacobian) {
  for (const auto& [robot, pose, label] : derivative_cases()) {
    SCOPED_TRACE(label);
    const auto numeric = numeric_pose_jacobian(
        [&](const Pose& p) { return platform_state(robot, p).length_m(); }, pose);
    EXPECT_TRUE(jacobian_matches(length_jacobian(platform_state(robot, pose)), numeric));
  }
}

TEST(Platform, SwivelJacobian) {
  for (const auto& [robot, pose, label] : derivative_cases()) {
    SCOPED_TRACE(label);
    const CableVector here = platform_state(robot, pose).swivel_rad();
    const auto numeric = numeric_pose_jacobian(
        [&](const Pose& p) {
          const CableVector moved = platform_state(robot, p).swivel_rad();
          return CableVector((moved - here).unaryExpr(&wrap_angle));
        },
        pose);
    EXPECT_TRUE(jacobian_matches(swivel_jacobian(platform_state(robot, pose)), numeric));
  }
}

TEST(Platform, ArmsTurnWithThePlatform) {
  for (const auto& [robot, pose, label] : derivative_cases()) {
    const PlatformState state = platform_state(robot, pose);
    ASSERT_TRUE(state.valid) << label;
    EXPECT_EQ(state.cable_count, robot.cable_count());
    EXPECT_LE((state.centre_of_mass_arm_m - pose.rotation * robot.platform.centre_of_mass_m).norm(),
              1e-15);
    for (int i = 0; i < state.cable_count; ++i) {
      EXPECT_LE((state.anchor_arm_m[i] - pose.rotation * robot.cables[i].platform_anchor_m).norm(),
                1e-15);
    }
  }
}

TEST(Platform, ARigidMotionOfRobotAndPoseChangesNoReading) {
  Rng rng(31);
  for (const auto& [robot, pose, label] : derivative_cases()) {
    SCOPED_TRACE(label);
    const Eigen::Quaterniond turn = test::random_rotation(rng);
    const Vector3 shift = test::uniform_vector(rng, -Vector3::Ones(), Vector3::Ones());
    Robot moved = robot;
    for (Cable& cable : moved.cables) {
      cable.pulley.position_m = (turn * cable.pulley.position_m + shift).eval();
      cable.pulley.axes_world = (turn.toRotationMatrix() * cable.pulley.axes_world).eval();
    }
    const Pose moved_pose{turn * pose.position_m + shift, (turn * pose.rotation).normalized()};
    const PlatformState before = platform_state(robot, pose);
    const PlatformState after = platform_state(moved, moved_pose);
    EXPECT_LE((after.length_m() - before.length_m()).norm(), 1e-13);
    const CableVector turned = (after.swivel_rad() - before.swivel_rad()).unaryExpr(&wrap_angle);
    EXPECT_LE(turned.norm(), 1e-12);
  }
}

TEST(Platform, TheFirstInvalidCableIsNamedFromOne) {
  const Robot robot = load_robot("irma4");
  Pose pose{{0.0, 0.0, 1.0}, Eigen::Quaterniond::Identity()};
  EXPECT_TRUE(platform_state(robot, pose).valid);
  EXPECT_EQ(describe_invalid(platform_state(robot, pose)), "");
  for (int i = 0; i < robot.cable_count(); ++i) {
    // This anchor in the middle of its pulley.
    const Cable& cable = robot.cables[i];
    pose.position_m = cable.pulley.position_m - cable.platform_anchor_m +
                      cable.pulley.radius_m * cable.pulley.x_axis();
    const PlatformState state = platform_state(robot, pose);
    EXPECT_FALSE(state.valid);
    EXPECT_EQ(describe_invalid(state),
              "cable " + std::to_string(i + 1) + ": the platform anchor is inside the pulley");
  }
}

TEST(Platform, CablesThatTheRobotDoesNotHaveAreNotLookedAt) {
  const Robot robot = load_robot("irma4");
  PlatformState state = platform_state(robot, {{0.0, 0.0, 1.0}, Eigen::Quaterniond::Identity()});
  state.cable[robot.cable_count()].status = CableStatus::anchor_inside_pulley;
  EXPECT_EQ(describe_invalid(state), "");
}

TEST(Platform, HasNoMoreCablesThanThereIsRoomFor) {
  Robot robot = load_robot("irma4");
  robot.cables.resize(kMaxCables, robot.cables[0]);
  EXPECT_EQ(platform_state(robot, {}).cable_count, kMaxCables);
  robot.cables.push_back(robot.cables[0]);
  EXPECT_THROW(platform_state(robot, {}), InputError);
}

}  // namespace
}  // namespace cdprcal
