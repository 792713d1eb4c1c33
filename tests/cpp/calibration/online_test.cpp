// The estimate while the robot is measured, against the calibration of the finished log.
#include "cdprcal/calibration/online.hpp"

#include <gtest/gtest.h>

#include "../support/run.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal {
namespace {

SyntheticLog made(const Robot& robot) {
  SyntheticLogOptions options;
  options.noise = reading_noise(robot.sigma, 0.2);
  options.seed = 5;
  options.dwell_s = 4.0;
  options.move_s = 4.0;
  return synthetic_log(robot, default_setpoints(robot, 2, 2, 2), options);
}

/// Up to the end of each rest: 8 s a stop at 10 Hz, the first 4 s of them at rest.
std::vector<Log> stretches(const Log& log) {
  std::vector<Log> out;
  Eigen::Index begin = 0;
  for (Eigen::Index end = 40; end <= log.sample_count(); end += 80) {
    out.push_back(test::cut(log, begin, end - begin));
    begin = end;
  }
  return out;
}

TEST(OnlineCalibration, EndsWhereTheFinishedLogDoesAndKnowsMoreWithEveryRest) {
  const Robot robot = load_robot("irma4");
  const SyntheticLog truth = made(robot);
  CalibrateOptions options;
  options.method = Method::statics;
  OnlineCalibration online(robot, options);
  const std::vector<Log> parts = stretches(truth.log);
  ASSERT_EQ(parts.size(), 8U);
  double first_m = kNaN;
  for (const Log& part : parts) {
    const Calibration& now = online.add(part);
    if (now.result.status != CalibrationStatus::converged) continue;
    if (std::isnan(first_m)) first_m = now.result.standard_deviation().head<3>().norm();
    const Vector6 error = minus(now.result.poses.front(), truth.poses.front());
    EXPECT_LT(error.dot(solve_symmetric(*now.result.covariance, error)), 27.9);  // χ² of 6, 0.9999
  }
  const CalibrationResult& last = online.calibration().result;
  ASSERT_EQ(last.status, CalibrationStatus::converged) << last.reason;
  EXPECT_LT(last.standard_deviation().head<3>().norm(), first_m);
  EXPECT_EQ(online.calibration().static_poses, 8);
  EXPECT_EQ(online.calibration().equilibria.size(), 8U);
  EXPECT_EQ(last.poses.size(), online.calibration().problem.measurements.size());
  const CalibrationResult whole = calibrate(robot, truth.log, options).result;
  const Vector6 apart = minus(last.poses.front(), whole.poses.front());
  EXPECT_TRUE((apart.array().abs() < whole.standard_deviation().array()).all());
}

TEST(OnlineCalibration, TimesOfTheRunGoOnFromStretchToStretch) {
  const Robot robot = load_robot("irma4");
  CalibrateOptions options;
  options.method = Method::statics;
  OnlineCalibration online(robot, options);
  for (const Log& part : stretches(made(robot).log)) online.add(part);
  const auto& all = online.calibration().problem.measurements;
  for (const Measurement& m : all) EXPECT_NEAR(m.run_time_s, m.time_s - all.front().time_s, 2.1);
  for (std::size_t i = 1; i < all.size(); ++i) EXPECT_GT(all[i].time_s, all[i - 1].time_s);
}

TEST(OnlineCalibration, RefusesWhatDoesNotFollowAndStaysAsItWas) {
  const Robot robot = load_robot("irma4");
  const std::vector<Log> parts = stretches(made(robot).log);
  OnlineCalibration online(robot);
  online.add(parts[0]);
  const std::size_t before = online.calibration().problem.measurements.size();
  EXPECT_THROW(online.add(parts[0]), InputError);
  EXPECT_THROW(online.add(test::cut(parts[1], 0, 0)), InputError);
  EXPECT_EQ(online.calibration().problem.measurements.size(), before);
  online.add(parts[1]);
  EXPECT_GT(online.calibration().problem.measurements.size(), before);
  CalibrateOptions finished;
  finished.at_s = {0.0, 1.0};
  EXPECT_THROW(OnlineCalibration(robot, finished), InputError);
  finished = {};
  finished.segment = 0;
  EXPECT_THROW(OnlineCalibration(robot, finished), InputError);
}

}  // namespace
}  // namespace cdprcal
