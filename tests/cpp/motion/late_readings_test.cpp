// Readings that come late, read when they come.
#include "cdprcal/motion/late_readings.hpp"

#include <gtest/gtest.h>

#include "cdprcal/effects/catalogue.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal::test {
namespace {

/// Rows so far apart, in which roll and the first cable's readings tell the time.
Log told_the_time(const Robot& robot, const Eigen::VectorXd& time_s) {
  Log log;
  log.time_s = time_s;
  log.length_m.setZero(time_s.size(), robot.cable_count());
  log.swivel_rad = log.tension_N = log.length_m;
  log.roll_pitch_yaw_rad.setZero(time_s.size(), 3);
  for (LogMatrix* read :
       {&log.length_m, &log.swivel_rad, &log.tension_N, &log.roll_pitch_yaw_rad}) {
    read->col(0) = time_s;
  }
  return log;
}

struct Late {
  const char* effect;
  Channel of;
  LogMatrix Log::* read;
};
constexpr std::array<Late, 4> kLate{{{"sensor_delay", Channel::yaw, &Log::roll_pitch_yaw_rad},
                                     {"length_delay", Channel::length, &Log::length_m},
                                     {"swivel_delay", Channel::swivel, &Log::swivel_rad},
                                     {"tension_delay", Channel::balance, &Log::tension_N}}};

Calibration late_by(const Robot& robot, double delay_s, const char* effect = "sensor_delay") {
  Calibration out;
  out.problem.robot = robot;
  if (delay_s > 0.0) {
    out.problem.effects = {{find_effect(effect), EffectValues::Constant(1, delay_s)}};
  }
  Measurement m;
  m.roll_pitch_yaw_rad.setZero();
  out.problem.measurements = {m};
  out.result.poses = {Pose{Vector3(0.0, 0.0, 0.6), Eigen::Quaterniond::Identity()}};
  return out;
}

TEST(LateReadings, AreThoseReadSoMuchLater) {
  const Robot robot = load_robot("irma4");
  const Log log = told_the_time(robot, Eigen::VectorXd::LinSpaced(101, 0.0, 1.0));
  const CorrectedRun run(robot, log);
  for (const Late& late : kLate) {
    const LateReadings read(late_by(robot, 0.072, late.effect), run);
    for (const Late& other : kLate) {
      const bool is_late = &other == &late;
      EXPECT_NEAR(read.ahead_s[other.of], is_late ? 0.07 : 0.0, 1e-12) << "whole samples";
      const auto told_s = (read.run.log.*other.read).col(0);
      for (Eigen::Index row = 0; row < 94; ++row)
        EXPECT_NEAR(told_s[row], log.time_s[row] + (is_late ? 0.07 : 0.0), 1e-12) << late.effect;
      EXPECT_EQ(told_s.tail(7).array().isNaN().all(), is_late) << "nothing follows";
    }
    EXPECT_EQ(read.run.log.time_s, log.time_s);
  }
}

TEST(LateReadings, AreMissingWhereSamplesAre) {
  const Robot robot = load_robot("irma4");
  Eigen::VectorXd time_s = Eigen::VectorXd::LinSpaced(40, 0.0, 0.39);
  time_s.tail(20).array() += 0.2;
  const Log log = told_the_time(robot, time_s);
  const CorrectedRun run(robot, log);
  const LateReadings read(late_by(robot, 0.05), run);
  for (Eigen::Index row = 0; row < 35; ++row) {
    const double roll_rad = read.run.log.roll_pitch_yaw_rad(row, 0);
    const bool follows = row < 15 || row >= 20;
    ASSERT_EQ(std::isfinite(roll_rad), follows) << row;
    if (follows) {
      EXPECT_NEAR(roll_rad, time_s[row] + 0.05, 1e-9);
    }
  }
}

TEST(LateReadings, AreAsReadWhereNothingIsLate) {
  const Robot robot = load_robot("irma4");
  const Log log = told_the_time(robot, Eigen::VectorXd::LinSpaced(101, 0.0, 1.0));
  const CorrectedRun run(robot, log);
  for (const double delay_s : {0.0, 0.004}) {
    const LateReadings read(late_by(robot, delay_s), run);
    EXPECT_EQ(read.ahead_s[Channel::yaw], 0.0);
    EXPECT_EQ(&read.run.log, &log);
  }
}

TEST(LateReadings, ComeOfWhatTheEffectMakesOfTheirRate) {
  const Robot robot = load_robot("irma4");
  const int n = robot.cable_count();
  for (const Late& late : kLate) {
    const Calibration calibration = late_by(robot, 0.08, late.effect);
    const ReadingVector by_rate =
        by_own_rate(robot, calibration.problem.effects, calibration.problem.measurements[0],
                    calibration.result.poses[0]);
    const std::vector<RowLabel> labels = geometric_rows(n);
    ASSERT_EQ(by_rate.size(), static_cast<Eigen::Index>(labels.size()));
    for (std::size_t r = 0; r < labels.size(); ++r) {
      const bool is_late = &row_of(labels[r].channel).of() == &row_of(late.of).of();
      EXPECT_NEAR(by_rate[static_cast<Eigen::Index>(r)], is_late ? -0.08 : 0.0, 1e-12)
          << late.effect << r;
    }
  }
}

}  // namespace
}  // namespace cdprcal::test
