// Whether a platform turns enough to say what depends on it.
#include "cdprcal/diagnosis/turns.hpp"

#include <gtest/gtest.h>

#include "../support/fitted_rests.hpp"
#include "cdprcal/diagnosis/generic.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal {
namespace {

/// posts8 at rests turned by `turn_rad` about one world axis and another way each time; fitted.
DiagnosisModel turned(const Vector3& turn_rad, double noise) {
  const Robot robot = load_robot("posts8");
  RandomNormal random(7);
  static const std::vector<SyntheticStop> level = default_stops(robot, 3, 3, 2);
  std::vector<SyntheticStop> stops = level;
  for (SyntheticStop& stop : stops) {
    Vector6 twist = Vector6::Zero();
    twist.tail<3>() = random() * turn_rad;
    stop.pose = plus(stop.pose, twist);
  }
  return test::fitted_rests(robot, stops, PoseKind::kinematic_pose,
                            reading_noise(robot.sigma, noise), 8);
}

TEST(Turns, NoiseIsNone) {
  for (const double noise : {0.1, 1.0}) {
    EXPECT_EQ(angles_that_vary(turned(Vector3::Zero(), noise)),
              (std::array<bool, 3>{false, false, false}));
  }
}

TEST(Turns, EachIsSeenByItself) {
  EXPECT_EQ(angles_that_vary(turned(Vector3(0.2, 0.0, 0.0), 0.1)),
            (std::array<bool, 3>{true, false, false}));
  EXPECT_EQ(angles_that_vary(turned(Vector3(0.0, 0.2, 0.0), 0.1)),
            (std::array<bool, 3>{false, true, false}));
  EXPECT_EQ(angles_that_vary(turned(Vector3(0.0, 0.0, 0.2), 0.1)),
            (std::array<bool, 3>{false, false, true}));
}

TEST(Turns, WhatDoesNotTurnDependsOnNoAngle) {
  const auto by_itself = [](const DiagnosisModel& model, const std::string& channel) {
    int count = 0;
    for (const auto& effect : generic_candidates(model)) {
      const GenericName what = *generic_name(*effect);
      count += what.channel == channel && what.depends_on == "reading";
    }
    return count;
  };
  EXPECT_EQ(by_itself(turned(Vector3::Zero(), 0.1), "roll_pitch"), 0);
  EXPECT_EQ(by_itself(turned(Vector3::Zero(), 0.1), "yaw"), 0);
  EXPECT_EQ(by_itself(turned(Vector3(0.2, 0.0, 0.2), 0.1), "roll_pitch"), 1);
  EXPECT_EQ(by_itself(turned(Vector3(0.2, 0.0, 0.2), 0.1), "yaw"), 1);
}

}  // namespace
}  // namespace cdprcal
