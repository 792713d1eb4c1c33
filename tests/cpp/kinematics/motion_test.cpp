// What platforms on guides may do.
#include "cdprcal/kinematics/motion.hpp"

#include <gtest/gtest.h>

#include "../support/random_robot.hpp"

namespace cdprcal::test {
namespace {

Robot guided(Rng& rng, Motion motion) {
  Robot robot = random_robot(rng, 4);
  robot.platform.motion = motion;
  if (row_of(motion).is_planar()) {
    robot.platform.motion_plane_normal = random_rotation(rng) * Vector3::UnitZ();
  }
  finalise(robot);
  return robot;
}

constexpr std::array<Motion, 4> kAll{Motion::r3t3, Motion::t3, Motion::r1t2, Motion::t2};

TEST(MotionOfPlatforms, WhatItMayDoAndWhatItMayNotAreAllTwistsOnce) {
  Rng rng(1);
  for (int trial = 0; trial < 40; ++trial) {
    const Robot robot = guided(rng, kAll[static_cast<std::size_t>(trial) % 4]);
    const TwistBasis free = motion_basis(robot), held = guided_basis(robot);
    EXPECT_EQ(free.cols(), freedoms(robot));
    ASSERT_EQ(free.cols() + held.cols(), 6);
    Matrix6 all;
    all << free, held;
    EXPECT_LE((all.transpose() * all - Matrix6::Identity()).norm(), 1e-12);
  }
}

TEST(MotionOfPlatforms, StepsAlongItStayOnIt) {
  Rng rng(2);
  for (int trial = 0; trial < 40; ++trial) {
    const Robot robot = guided(rng, kAll[static_cast<std::size_t>(trial) % 4]);
    const Pose pose = on_motion(robot, random_pose(rng, robot));
    EXPECT_LE(minus(on_motion(robot, pose), pose).norm(), 1e-12);
    const TwistBasis free = motion_basis(robot);
    Eigen::VectorXd step(free.cols());
    for (double& s : step) s = uniform(rng, -0.5, 0.5);
    const Pose next = plus(pose, free * step);
    EXPECT_LE(minus(on_motion(robot, next), next).norm(), 1e-12);
  }
}

TEST(MotionOfPlatforms, TheNearestPoseIsNearest) {
  Rng rng(3);
  for (int trial = 0; trial < 40; ++trial) {
    const Robot robot = guided(rng, kAll[static_cast<std::size_t>(trial) % 4]);
    const Pose pose = random_pose(rng, robot);
    const Pose nearest = on_motion(robot, pose);
    const auto apart = [&](const Pose& other) {
      return std::pair((other.position_m - pose.position_m).norm(),
                       rotation_distance_rad(other, pose));
    };
    const auto [shift, turn] = apart(nearest);
    const TwistBasis free = motion_basis(robot);
    for (int i = 0; i < 10; ++i) {
      Eigen::VectorXd step(free.cols());
      for (double& s : step) s = uniform(rng, -0.2, 0.2);
      const auto [other_shift, other_turn] = apart(plus(nearest, free * step));
      EXPECT_GE(other_shift, shift - 1e-12);
      EXPECT_GE(other_turn, turn - 1e-9);
    }
  }
}

}  // namespace
}  // namespace cdprcal::test
