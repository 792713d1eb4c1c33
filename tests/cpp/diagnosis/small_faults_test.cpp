// Faults of the attitude's map that change readings as little as an effect does.
#include "cdprcal/diagnosis/small_faults.hpp"

#include <gtest/gtest.h>

#include "../support/run.hpp"

namespace cdprcal {
namespace {

using test::startup_log;
using test::summary;

/// irma4 whose AHRS speaks another order than the built-in file says.
Robot speaking(EulerConvention order) {
  Robot robot = load_robot("irma4");
  robot.euler_convention = order;
  return robot;
}

class SmallFaultsOf : public testing::TestWithParam<std::uint64_t> {
 protected:
  const Robot robot = load_robot("irma4");
  Log log = startup_log(robot, 0.1, GetParam(), 3);
  Log other = startup_log(speaking(EulerConvention::ZYX), 0.1, GetParam(), 3);
};

TEST_P(SmallFaultsOf, AnotherOrderIsFoundAtSmallTilts) {
  const Diagnosis d = diagnose(robot, {other});
  EXPECT_EQ(d.verdict, Verdict::explained) << summary(d);
  ASSERT_EQ(d.faults.size(), 1U) << summary(d);
  EXPECT_EQ(d.faults[0].name, "euler_convention");
  EXPECT_EQ(d.faults[0].convention, EulerConvention::ZYX) << d.faults[0].text;
  EXPECT_GT(d.faults[0].log_evidence, 5.0);
  EXPECT_TRUE(d.effects.empty()) << summary(d);
  EXPECT_EQ(d.corrected.euler_convention, EulerConvention::ZYX);
}

TEST_P(SmallFaultsOf, ADriftDoesNotHideIt) {
  other.roll_pitch_yaw_rad.col(2) += 4e-4 * other.time_s;
  const Diagnosis d = diagnose(robot, {other});
  ASSERT_EQ(d.faults.size(), 1U) << summary(d);
  EXPECT_EQ(d.faults[0].convention, EulerConvention::ZYX) << d.faults[0].text;
  ASSERT_EQ(d.effects.size(), 1U) << summary(d);
  EXPECT_EQ(d.effects[0].effect->name(), "yaw_drift");
}

TEST_P(SmallFaultsOf, ADriftAloneIsNoOrder) {
  log.roll_pitch_yaw_rad.col(2) += 4e-4 * log.time_s;
  const Diagnosis d = diagnose(robot, {log});
  EXPECT_TRUE(d.faults.empty()) << summary(d);
  ASSERT_EQ(d.effects.size(), 1U) << summary(d);
  EXPECT_EQ(d.effects[0].effect->name(), "yaw_drift");
}

TEST_P(SmallFaultsOf, ReversedAnglesAreFoundAndSetRightInTheCorrectedRobot) {
  Log mounted = log;
  mounted.roll_pitch_yaw_rad.rightCols(2) *= -1.0;  // as axes that point down have it
  const Diagnosis d = diagnose(robot, {mounted});
  ASSERT_EQ(d.faults.size(), 1U) << summary(d);
  EXPECT_EQ(d.faults[0].name, "attitude_sign");
  EXPECT_EQ(d.faults[0].values, (std::vector<double>{1, -1, -1}));
  const Diagnosis again = diagnose(d.corrected, {mounted});
  EXPECT_EQ(again.verdict, Verdict::consistent) << summary(again);
}

TEST_P(SmallFaultsOf, AnAngleThatReadsPartOfAnotherIsNoOrder) {
  log.roll_pitch_yaw_rad.col(0) += 0.1 * log.roll_pitch_yaw_rad.col(1);
  const Diagnosis d = diagnose(robot, {log});
  EXPECT_TRUE(d.faults.empty()) << summary(d);
  EXPECT_EQ(d.verdict, Verdict::described) << summary(d);
  ASSERT_FALSE(d.effects.empty());
  EXPECT_EQ(d.effects[0].effect->name(), "roll_by_pitch_line");
}

INSTANTIATE_TEST_SUITE_P(Seeds, SmallFaultsOf, testing::Values(411, 412, 413));

TEST(SmallFaults, OneTakesThePlaceOfAnother) {
  const Robot robot = load_robot("irma4");
  std::vector<Log> logs{startup_log(robot, 0.1, 414, 3)};
  const Log given = logs.front();
  const Diagnosis d = diagnose(robot, logs);
  SmallFaults faults(d.baseline);
  const DiscreteFault sign{"attitude_sign", "sign", {1, 1, -1}, "the AHRS counts yaw backwards"};
  faults.take(sign, logs);
  EXPECT_EQ(logs[0].roll_pitch_yaw_rad.col(2), -given.roll_pitch_yaw_rad.col(2));
  const DiscreteFault order{"euler_convention",  "convention", {5}, "", {}, {},
                            EulerConvention::ZYX};
  faults.take(order, logs);
  EXPECT_EQ(logs[0].roll_pitch_yaw_rad, given.roll_pitch_yaw_rad);
  EXPECT_EQ(faults.taken()->name, "euler_convention");
}

}  // namespace
}  // namespace cdprcal
