#include "cdprcal/kinematics/obstruction.hpp"

#include <gtest/gtest.h>

#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal {
namespace {

class Obstruction : public ::testing::Test {
 protected:
  [[nodiscard]] std::string at(const Vector3& position_m) const {
    const Pose pose{position_m, Eigen::Quaterniond::Identity()};
    const PlatformState state = platform_state(robot, pose);
    const std::string said = obstruction(robot, pose, state);
    EXPECT_EQ(is_clear(robot, pose, state), said.empty());
    return said;
  }

  Robot robot = load_robot("irma4");
};

TEST_F(Obstruction, IsNothingWhereTheFileSaysNothing) {
  EXPECT_FALSE(robot.surroundings.any());
  EXPECT_EQ(at({0.0, 0.0, 0.5}), "");
  EXPECT_EQ(at({0.0, 0.0, -9.0}), "");
}

TEST_F(Obstruction, KnowsTheFloorUnderTheLowestPart) {
  double lowest_m = 0.0;
  for (const Cable& cable : robot.cables) {
    lowest_m = std::min(lowest_m, cable.platform_anchor_m.z());
  }
  robot.surroundings.floor_m = 0.4;
  EXPECT_EQ(at({0.0, 0.0, 0.401 - lowest_m}), "");
  EXPECT_NE(at({0.0, 0.0, 0.399 - lowest_m}).find("below floor_m 0.400"), std::string::npos);
  robot.platform.outline_m = {{0.0, 0.0, -0.3}};
  EXPECT_NE(at({0.0, 0.0, 0.699}).find("z = 0.399 m"), std::string::npos);
  EXPECT_EQ(at({0.0, 0.0, 0.701}), "");
}

TEST_F(Obstruction, KeepsPlatformAndCablesOutOfBoxes) {
  robot.surroundings.keep_out = {{{-9.0, -9.0, -9.0}, {-8.0, -8.0, -8.0}},
                                 {{0.5, -0.2, 0.0}, {0.9, 0.2, 1.1}}};
  EXPECT_EQ(at({-0.6, 0.0, 1.5}), "");
  EXPECT_EQ(at({0.7, 0.0, 0.5}), "the platform is in keep_out[#2]");
  // A thin bar across one cable, far from the platform: in the middle of what is free of it.
  const Pose pose{Vector3(0.0, 0.0, 1.0), Eigen::Quaterniond::Identity()};
  const PlatformState state = platform_state(robot, pose);
  const CableState& cable = state.cable[2];
  const Vector3 middle =
      pose.position_m + state.anchor_arm_m[2] - 0.5 * cable.free_length_m * cable.direction;
  const Vector3 thin(0.01, 0.01, 0.01);
  robot.surroundings.keep_out = {{middle - thin, middle + thin}};
  EXPECT_EQ(at(pose.position_m), "cable 3 passes through keep_out[#1]");
  const Vector3 beyond = pose.position_m + state.anchor_arm_m[2] + 0.2 * cable.direction;
  robot.surroundings.keep_out = {{beyond - thin, beyond + thin}};
  EXPECT_EQ(at(pose.position_m).find("cable"), std::string::npos);  // the line ends at its anchor
}

TEST_F(Obstruction, KnowsHowLongCablesMayBe) {
  const Pose pose{Vector3(0.1, 0.0, 1.0), Eigen::Quaterniond::Identity()};
  const CableVector length_m = platform_state(robot, pose).length_m();
  robot.surroundings.length_max_m = length_m.maxCoeff() + 1e-6;
  robot.surroundings.length_min_m = length_m.minCoeff() - 1e-6;
  EXPECT_EQ(at(pose.position_m), "");
  robot.surroundings.length_max_m = length_m.maxCoeff() - 1e-6;
  EXPECT_NE(at(pose.position_m).find("length_limits_m"), std::string::npos);
  robot.surroundings.length_max_m = 100.0;
  robot.surroundings.length_min_m = length_m.minCoeff() + 1e-6;
  EXPECT_NE(at(pose.position_m).find("length_limits_m"), std::string::npos);
}

}  // namespace
}  // namespace cdprcal
