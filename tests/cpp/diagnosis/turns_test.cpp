// Whether a platform turns enough to say what depends on it.
#include "cdprcal/diagnosis/turns.hpp"

#include <gtest/gtest.h>

#include "../support/run.hpp"
#include "cdprcal/diagnosis/generic.hpp"

namespace cdprcal {
namespace {

/// posts8 at rests turned by `turn_rad` about one world axis and another way each time; fitted.
DiagnosisModel turned(const Vector3& turn_rad, double noise) {
  DiagnosisModel model;
  model.robot = load_robot("posts8");
  RandomNormal random(7);
  const ReadingOffsets offsets = random_offsets(8, random);
  DiagnosisRun run;
  static const std::vector<SyntheticStop> stops = default_stops(model.robot, 3, 3, 2);
  for (SyntheticStop stop : stops) {
    Vector6 twist = Vector6::Zero();
    twist.tail<3>() = random() * turn_rad;
    stop.pose = plus(stop.pose, twist);
    run.measurements.push_back(
        synthetic_measurement(model.robot, stop.pose, stop.tension_N, PoseKind::kinematic_pose,
                              offsets, reading_noise(model.robot.sigma, noise), random));
    run.poses.push_back(stop.pose);
  }
  run.offsets = offsets_at(model.robot, run.poses[0], run.measurements[0]);
  model.runs.push_back(run);
  start_noise(model, Signals{});
  EXPECT_TRUE(fit_with_noise(model));
  return model;
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
