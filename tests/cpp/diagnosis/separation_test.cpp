#include "cdprcal/diagnosis/separation.hpp"

#include <gtest/gtest.h>

#include "cdprcal/effects/applied.hpp"
#include "run.hpp"

namespace cdprcal {
namespace {

DiagnosisModel model_with(const std::string& effect, const EffectValues& values) {
  const Robot robot = load_robot("irma4");
  DiagnosisModel model = diagnose(robot, {test::startup_log(robot, 0.2, 5, 0)}).baseline;
  model.effects.push_back({find_effect(effect), values});
  return model;
}

TEST(SeparatingPoses, RaiseTheExpectedEvidenceOneByOneWithinTheLimits) {
  // Ratio errors and stretch: eight poses with little spread in tension.
  const DiagnosisModel model = model_with("cable_elasticity", EffectValues::Constant(1, 1e-5));
  const Separation found = separating_poses(model, 0, find_effect("transmission_ratio"), 3);
  ASSERT_FALSE(found.poses.empty());
  double reached = found.nats;
  for (const SeparatingPose& pose : found.poses) {
    EXPECT_GT(pose.nats, reached);
    reached = pose.nats;
    EXPECT_GE(pose.tension_N.minCoeff(), model.robot.tension_min_N - 1e-6);
    EXPECT_LE(pose.tension_N.maxCoeff(), model.robot.tension_max_N + 1e-6);
  }
}

TEST(SeparatingPoses, NoneTellAnEffectFromItself) {
  const DiagnosisModel model = model_with("mass", EffectValues::Constant(1, 0.7));
  const Separation found = separating_poses(model, 0, find_effect("mass"));
  // Only the rival's prior stands against it: half a nat for one typical size.
  EXPECT_LT(found.nats, 0.51);
  EXPECT_TRUE(found.poses.empty());
}

TEST(RunNames, ShortestThatTellLogsApart) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(run_names({"a/run.csv", "b/other.csv"}), (Names{"run.csv", "other.csv"}));
  EXPECT_EQ(run_names({"x/a/run.csv", "x/b/run.csv"}), (Names{"a/run.csv", "b/run.csv"}));
  EXPECT_EQ(run_names({"run.csv", "b/run.csv"}), (Names{"run.csv", "b/run.csv"}));
  EXPECT_EQ(run_names({"same.csv", "same.csv"}), (Names{"same.csv", "same.csv"}));
  EXPECT_EQ(run_names({"/a/run.csv"}), (Names{"run.csv"}));
}

TEST(RunNames, AnEffectOfARunStaysWithItsLog) {
  Robot robot = load_robot("irma4");
  robot.effects.push_back({"yaw_drift", "a/run.csv", {{"rate_rad_s", {1e-4}}}});
  EXPECT_EQ(resolve_effects(robot, "/data/a/run.csv").size(), 1U);
  EXPECT_EQ(resolve_effects(robot, "a/run.csv").size(), 1U);
  EXPECT_TRUE(resolve_effects(robot, "/data/b/run.csv").empty());
  EXPECT_TRUE(resolve_effects(robot, "/data/aa/run.csv").empty());
}

}  // namespace
}  // namespace cdprcal
