// First readings that are worse than those that follow.
#include "cdprcal/calibration/unsettled_start.hpp"

#include <gtest/gtest.h>

#include "../support/run.hpp"
#include "cdprcal/geometry/pose.hpp"

namespace cdprcal {
namespace {

SyntheticLog made(double noise, std::uint64_t seed) {
  const Robot robot = load_robot("irma4");
  SyntheticLogOptions options;
  options.noise = reading_noise(robot.sigma, noise);
  options.seed = seed;
  options.dwell_s = options.move_s = 4.0;
  return synthetic_log(robot, default_setpoints(robot, 2, 2, 2), options);
}

/// Each reading of the first sample off by so many σ of the robot file, as before a low-pass of
/// many samples has reduced their noise.
void disturb(Log& log, double sigmas, std::uint64_t seed) {
  const SensorSigma sigma = load_robot("irma4").sigma;
  RandomNormal random(seed);
  for (double& v : log.length_m.row(0)) v += sigmas * sigma.length_m * random();
  for (double& v : log.swivel_rad.row(0)) v += sigmas * sigma.swivel_rad * random();
  for (double& v : log.roll_pitch_yaw_rad.row(0)) v += sigmas * sigma.attitude_rad * random();
  for (double& v : log.tension_N.row(0)) v += sigmas * sigma.tension_N * random();
}

/// How many of its own σ a start is off along the worst axis.
double largest_z(const Calibration& found, const Pose& truth) {
  const Vector6 off = minus(truth, found.result.poses.front());
  return off.cwiseQuotient(found.result.standard_deviation()).cwiseAbs().maxCoeff();
}

TEST(UnsettledStart, ALowPassThatStartsDoesNotShiftTheInitialPose) {
  const Robot robot = load_robot("irma4");
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SyntheticLog start = made(0.05, seed);
    disturb(start.log, 2.0, 100 + seed);
    const Calibration found = calibrate(robot, start.log);
    ASSERT_EQ(found.result.status, CalibrationStatus::converged);
    EXPECT_GT(found.problem.measurements.front().samples, 4);
    EXPECT_LT(largest_z(found, start.poses.front()), 4.0);
  }
}

/// Noise behind a low-pass that runs ten times as fast as the log, and began with a raw reading:
/// of one reading it leaves so much of σ of the robot file.
void filter(Log& log, double share, double correlation, std::uint64_t seed) {
  constexpr double kRaw = 5.0;
  const SensorSigma sigma = load_robot("irma4").sigma;
  RandomNormal random(seed);
  const auto add = [&](LogMatrix& readings, double of_one) {
    for (Eigen::Index column = 0; column < readings.cols(); ++column) {
      double noise = kRaw * random();
      for (double& v : readings.col(column)) {
        v += share * of_one * noise;
        noise = correlation * noise + std::sqrt(1.0 - correlation * correlation) * random();
      }
    }
  };
  add(log.length_m, sigma.length_m);
  add(log.swivel_rad, sigma.swivel_rad);
  add(log.roll_pitch_yaw_rad, sigma.attitude_rad);
  add(log.tension_N, sigma.tension_N);
}

TEST(UnsettledStart, AReadingBeforeALongRestIsOffAndNotAMotion) {
  const Robot robot = load_robot("irma4");
  int alone = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SyntheticLog start = made(1.0, seed);
    disturb(start.log, 3.0, 300 + seed);
    const Calibration found = calibrate(robot, start.log);
    ASSERT_EQ(found.result.status, CalibrationStatus::converged);
    if (found.problem.measurements.front().samples == 1) ++alone;
    EXPECT_LT(largest_z(found, start.poses.front()), 4.0) << seed;
  }
  EXPECT_EQ(alone, 0);
}

TEST(UnsettledStart, AFilterThatRunsInForSeveralSamplesDoesNotShiftIt) {
  const Robot robot = load_robot("irma4");
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SyntheticLog start = made(0.0, seed);
    filter(start.log, 0.4, seed % 2 == 0 ? 0.37 : 0.55, 200 + seed);
    const Calibration found = calibrate(robot, start.log);
    ASSERT_EQ(found.result.status, CalibrationStatus::converged);
    EXPECT_GT(found.problem.measurements.front().samples, 4) << seed;
    EXPECT_LT(largest_z(found, start.poses.front()), 4.0) << seed;
  }
}

TEST(UnsettledStart, OneOddFirstReadingIsNoMotion) {
  const Robot robot = load_robot("irma4");
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    // Noise in which lengths and swivels do not contradict a turn of four degrees.
    SyntheticLog start = made(0.5, seed);
    start.log.roll_pitch_yaw_rad(0, 0) += 0.07;
    for (const bool gap : {false, true}) {
      if (gap) start.log.roll_pitch_yaw_rad(4, 0) = kNaN;
      const Calibration found = calibrate(robot, start.log);
      ASSERT_EQ(found.result.status, CalibrationStatus::converged);
      EXPECT_GT(found.problem.measurements.front().samples, 4) << gap;
      EXPECT_LT(largest_z(found, start.poses.front()), 4.0) << gap;
    }
  }
}

TEST(UnsettledStart, ASampleThatIsOddItselfIsNotTheStartInstead) {
  const Robot robot = load_robot("irma4");
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SyntheticLog start = made(1.0, seed);
    start.log.length_m(0, 3) += 0.2;
    start.log.roll_pitch_yaw_rad(2, 1) -= 0.3;  // as a swing would
    const Calibration found = calibrate(robot, start.log);
    ASSERT_EQ(found.result.status, CalibrationStatus::converged);
    EXPECT_LT(largest_z(found, start.poses.front()), 4.0);
  }
}

TEST(UnsettledStart, AGoodStartStays) {
  const Robot robot = load_robot("irma4");
  const SyntheticLog start = made(0.05, 7);
  const Calibration found = calibrate(robot, start.log);
  EXPECT_FALSE(unsettled_start(start.log, segments(start.log).back(), found, 1.0));
}

TEST(UnsettledStart, APlatformThatMovedAtOnceIsWhereItWasFirst) {
  const Robot robot = load_robot("irma4");
  // The first sample is of the first rest, all others from the second on, some centimetres away.
  std::vector<CableVector> setpoints_N = default_setpoints(robot, 2, 2, 2);
  setpoints_N[1] = 0.9 * setpoints_N[0] + 0.1 * setpoints_N[1];
  const Log whole = test::run_through(robot, setpoints_N, 0.05, 9);
  const Eigen::Index second = calibrate(robot, whole).equilibria.at(1).samples.begin;
  Log log = test::cut(whole, second - 1, whole.sample_count() - second + 1);
  log.time_s.array() -= log.time_s[0];
  log.length_m.row(0) = whole.length_m.row(0);
  log.swivel_rad.row(0) = whole.swivel_rad.row(0);
  log.tension_N.row(0) = whole.tension_N.row(0);
  log.roll_pitch_yaw_rad.row(0) = whole.roll_pitch_yaw_rad.row(0);
  const double moved_m = (log.length_m.row(1) - log.length_m.row(0)).norm();
  EXPECT_GT(moved_m, 0.01);
  EXPECT_LT(moved_m, 0.3);
  const Calibration found = calibrate(robot, log);
  ASSERT_FALSE(found.result.poses.empty());
  EXPECT_EQ(found.problem.measurements.front().samples, 1);
}

}  // namespace
}  // namespace cdprcal
