// An attitude that comes late, read when it comes.
#include "cdprcal/motion/late_attitude.hpp"

#include <gtest/gtest.h>

#include "cdprcal/effects/catalogue.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal::test {
namespace {

/// Rows so far apart, whose roll tells the time.
Log told_by_roll(const Robot& robot, const Eigen::VectorXd& time_s) {
  Log log;
  log.time_s = time_s;
  log.length_m.setZero(time_s.size(), robot.cable_count());
  log.roll_pitch_yaw_rad.setZero(time_s.size(), 3);
  log.roll_pitch_yaw_rad.col(0) = time_s;
  return log;
}

Calibration late_by(const Robot& robot, double delay_s) {
  Calibration out;
  out.problem.robot = robot;
  if (delay_s > 0.0) {
    out.problem.effects = {{find_effect("sensor_delay"), EffectValues::Constant(1, delay_s)}};
  }
  Measurement m;
  m.roll_pitch_yaw_rad.setZero();
  out.problem.measurements = {m};
  out.result.poses = {Pose{Vector3(0.0, 0.0, 0.6), Eigen::Quaterniond::Identity()}};
  return out;
}

TEST(LateAttitudes, AreThoseReadSoMuchLater) {
  const Robot robot = load_robot("irma4");
  const Log log = told_by_roll(robot, Eigen::VectorXd::LinSpaced(101, 0.0, 1.0));
  const CorrectedRun run(robot, log);
  const LateAttitudes read(late_by(robot, 0.072), run);
  EXPECT_NEAR(read.ahead_s, 0.07, 1e-12) << "whole samples";
  const auto roll_rad = read.run.log.roll_pitch_yaw_rad.col(0);
  for (Eigen::Index row = 0; row < 94; ++row)
    EXPECT_NEAR(roll_rad[row], log.time_s[row] + 0.07, 1e-12);
  EXPECT_TRUE(roll_rad.tail(7).array().isNaN().all()) << "nothing follows";
  EXPECT_EQ(read.run.log.time_s, log.time_s);
}

TEST(LateAttitudes, AreMissingWhereSamplesAre) {
  const Robot robot = load_robot("irma4");
  Eigen::VectorXd time_s = Eigen::VectorXd::LinSpaced(40, 0.0, 0.39);
  time_s.tail(20).array() += 0.2;
  const Log log = told_by_roll(robot, time_s);
  const CorrectedRun run(robot, log);
  const LateAttitudes read(late_by(robot, 0.05), run);
  for (Eigen::Index row = 0; row < 35; ++row) {
    const double roll_rad = read.run.log.roll_pitch_yaw_rad(row, 0);
    const bool follows = row < 15 || row >= 20;
    ASSERT_EQ(std::isfinite(roll_rad), follows) << row;
    if (follows) {
      EXPECT_NEAR(roll_rad, time_s[row] + 0.05, 1e-9);
    }
  }
}

TEST(LateAttitudes, AreAsReadWhereNothingIsLate) {
  const Robot robot = load_robot("irma4");
  const Log log = told_by_roll(robot, Eigen::VectorXd::LinSpaced(101, 0.0, 1.0));
  const CorrectedRun run(robot, log);
  for (const double delay_s : {0.0, 0.004}) {
    const LateAttitudes read(late_by(robot, delay_s), run);
    EXPECT_EQ(read.ahead_s, 0.0);
    EXPECT_EQ(&read.run.log, &log);
  }
}

TEST(LateAttitudes, ComeOfWhatTheEffectMakesOfTheRate) {
  const Robot robot = load_robot("irma4");
  const Calibration late = late_by(robot, 0.08);
  const Matrix3 by_rate = attitude_by_rate(robot, late.problem.effects,
                                           late.problem.measurements[0], late.result.poses[0]);
  EXPECT_LT((by_rate + 0.08 * Matrix3::Identity()).norm(), 1e-12);
}

}  // namespace
}  // namespace cdprcal::test
