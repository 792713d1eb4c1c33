// Readings that stand out of those around them: in events_test.cpp for the paper's sensors.
#include "cdprcal/readings/outliers.hpp"

#include <gtest/gtest.h>

#include "../support/run.hpp"
#include "cdprcal/calibration/calibrate.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal::test {
namespace {

constexpr Eigen::Index kRows = 60;

/// A sensor's readings of a slow motion with a ripple of so much; the first columns of each.
LogMatrix rippling(int columns, double ripple, std::uint64_t seed) {
  RandomNormal random(seed);
  LogMatrix out(kRows, columns);
  for (Eigen::Index i = 0; i < kRows; ++i) {
    for (int c = 0; c < columns; ++c)
      out(i, c) = 0.002 * static_cast<double>(i) + ripple * random();
  }
  return out;
}

Log of_absolute_sensors() {
  Log log;
  log.time_s = Eigen::VectorXd::LinSpaced(kRows, 0.0, 5.9);
  log.position_m = rippling(3, 1e-4, 1);
  log.absolute_yaw_rad = rippling(1, 1e-3, 2);
  log.specific_force_m_s2 = rippling(3, 1e-2, 3);
  return log;
}

TEST(Outliers, AreLookedForInEverySensorThatDoesNotJerkWithThePlatform) {
  const SensorSigma sigma;
  Log log = of_absolute_sensors();
  const Log clean = log;
  EXPECT_TRUE(leave_out_outliers(sigma, {0, kRows}, log).empty());
  log.position_m(20, 1) += 0.05;
  log.absolute_yaw_rad(30, 0) -= 0.5;
  log.specific_force_m_s2(40, 2) += 5.0;
  const auto outliers = leave_out_outliers(sigma, {0, kRows}, log);
  ASSERT_EQ(outliers.size(), 2U);
  EXPECT_EQ(outliers[0].channel, Channel::absolute_yaw);
  EXPECT_EQ(outliers[0].begin_s, log.time_s[30]);
  EXPECT_NEAR(outliers[0].off, -0.5, 0.01);
  EXPECT_EQ(outliers[1].channel, Channel::position);
  EXPECT_EQ(outliers[1].column, 1);
  EXPECT_TRUE(std::isnan(log.position_m(20, 1)) && std::isnan(log.absolute_yaw_rad(30, 0)));
  EXPECT_EQ(log.position_m.array().isNaN().count(), 1);
  EXPECT_EQ(log.specific_force_m_s2(40, 2), clean.specific_force_m_s2(40, 2) + 5.0);
}

TEST(Outliers, DoNotHideEachOtherButAnOscillationIsNone) {
  Log log = of_absolute_sensors();
  const Log clean = log;
  for (const Eigen::Index row : {20, 24, 29}) log.position_m(row, 1) += row == 24 ? -0.02 : 0.05;
  EXPECT_EQ(leave_out_outliers({}, {0, kRows}, log).size(), 3U);
  EXPECT_EQ(log.position_m.array().isNaN().count(), 3);
  log = clean;
  for (Eigen::Index row = 12; row < 48; row += 3) log.position_m(row, 1) += 0.05;
  EXPECT_TRUE(leave_out_outliers({}, {0, kRows}, log).empty());
}

TEST(Outliers, AtTheEndsOfARunAreNotTakenForItsMotion) {
  Log log = of_absolute_sensors();
  log.position_m.col(0) *= 10.0;  // in motion from the first sample on
  EXPECT_TRUE(leave_out_outliers({}, {0, kRows}, log).empty());
  log.position_m(0, 1) -= 0.05;
  log.position_m(kRows - 2, 1) += 0.05;
  EXPECT_EQ(leave_out_outliers({}, {0, kRows}, log).size(), 2U);
  EXPECT_TRUE(std::isnan(log.position_m(0, 1)) && std::isnan(log.position_m(kRows - 2, 1)));
  EXPECT_EQ(log.position_m.array().isNaN().count(), 2);
}

TEST(Outliers, AHeldReadingIsOneAndTheRunAloneIsLookedAt) {
  Log log = of_absolute_sensors();
  constexpr Eigen::Index kHeld = 3;
  for (Eigen::Index i = 0; i < kRows; ++i)
    log.position_m.row(i) = log.position_m.row(i / kHeld * kHeld);
  log.position_m.col(2).segment(30, kHeld).array() += 0.05;
  Log shorter = log;
  EXPECT_TRUE(leave_out_outliers({}, {33, kRows}, shorter).empty());
  const auto outliers = leave_out_outliers({}, {0, kRows}, log);
  ASSERT_EQ(outliers.size(), 1U);
  EXPECT_EQ(outliers[0].begin_s, log.time_s[30]);
  EXPECT_EQ(outliers[0].end_s, log.time_s[32]);
  EXPECT_EQ(log.position_m.array().isNaN().count(), kHeld);
}

TEST(Outliers, ACableThatMovesPastEmptyCellsIsNone) {
  RandomNormal random(7);
  for (int run = 0; run < 20; ++run) {
    Log log = of_absolute_sensors();
    for (Eigen::Index i = 0; i < kRows; ++i) {
      log.position_m.row(i).array() += 0.05 * static_cast<double>(i);
      for (int c = 0; c < 3; ++c) {
        if (random() < -0.7) log.position_m(i, c) = kNaN;  // a quarter
      }
    }
    EXPECT_TRUE(leave_out_outliers({}, {0, kRows}, log).empty()) << run;
  }
}

TEST(Outliers, InMotionDoNotReachACalibrationWithNoiseFromTheReadings) {
  const Robot robot = load_robot("irma4");
  const Log clean = startup_log(robot, 0.2, 11, 0);
  const Calibration expected = calibrate(robot, clean);
  ASSERT_EQ(expected.result.status, CalibrationStatus::converged);
  ASSERT_GT(expected.kinematic_poses, 10);
  Log spiked = clean;
  for (const Measurement& m : expected.problem.measurements) {
    if (m.kind != PoseKind::kinematic_pose) continue;
    const double* times = clean.time_s.data();
    const Eigen::Index row =
        std::lower_bound(times, times + clean.sample_count(), m.time_s) - times;
    spiked.swivel_rad(row, 0) += 5.0 * kDegree;
  }
  const Calibration found = calibrate(robot, spiked);
  ASSERT_EQ(found.result.status, CalibrationStatus::converged);
  const Vector6 off = minus(found.result.poses.front(), expected.result.poses.front());
  const Vector6 sigma = expected.result.covariance->diagonal().cwiseSqrt();
  EXPECT_LT((off.array() / sigma.array()).abs().maxCoeff(), 0.5);
  CalibrateOptions every;
  every.noise = NoiseSource::specified;
  const Vector6 moved = minus(calibrate(robot, spiked, every).result.poses.front(),
                              calibrate(robot, clean, every).result.poses.front());
  EXPECT_GT((moved.array() / sigma.array()).abs().maxCoeff(), 0.5);
}

}  // namespace
}  // namespace cdprcal::test
