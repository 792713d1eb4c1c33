#include "cdprcal/diagnosis/allow_for_effects.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "run.hpp"

namespace cdprcal {
namespace {

/// Eight rests of irma4 with what really was.
SyntheticLog made(bool absolute = false) {
  const Robot robot = load_robot("irma4");
  SyntheticLogOptions options;
  options.noise = reading_noise(robot.sigma, 0.2, absolute);
  options.seed = 81;
  options.dwell_s = 4.0;
  options.move_s = 4.0;
  return synthetic_log(robot, default_setpoints(robot, 2, 2, 2), options);
}

Log biased(Log log) {
  log.tension_N.rowwise() += Eigen::RowVector4d(12.0, -10.0, 11.0, -14.0);
  return log;
}

void expect_same(const Calibration& a, const Calibration& b) {
  EXPECT_EQ(a.result.poses.front().position_m, b.result.poses.front().position_m);
  EXPECT_EQ(a.result.covariance, b.result.covariance);
  EXPECT_EQ(a.result.reason, b.result.reason);
}

TEST(AllowForEffects, ChangesNothingWhereTheModelFits) {
  const Robot robot = load_robot("irma4");
  const Log log = made().log;
  const Calibration plain = calibrate(robot, log);
  EXPECT_EQ(misfit(plain), "");
  expect_same(calibrate_allowing_for_effects(robot, log), plain);
}

TEST(AllowForEffects, ChangesNothingUnasked) {
  const Robot robot = load_robot("irma4");
  const Log log = biased(made().log);
  CalibrateOptions options;
  options.allow_for_effects = false;
  expect_same(calibrate_allowing_for_effects(robot, log, options), calibrate(robot, log, options));
  options.allow_for_effects = true;
  options.noise = NoiseSource::specified;  // the user's word against the residuals'
  expect_same(calibrate_allowing_for_effects(robot, log, options), calibrate(robot, log, options));
}

TEST(AllowForEffects, CountsWhatAnErrorThatAllReadingsShareCanDo) {
  const Robot robot = load_robot("irma4");
  const SyntheticLog truth = made();
  const Log log = biased(truth.log);
  const Calibration plain = calibrate(robot, log);
  ASSERT_EQ(plain.result.status, CalibrationStatus::converged) << plain.result.reason;
  EXPECT_NE(misfit(plain).find("the balance by "), std::string::npos) << misfit(plain);
  const Calibration allowing = calibrate_allowing_for_effects(robot, log);
  EXPECT_NE(allowing.result.reason.find("the model misfits " + misfit(plain)), std::string::npos);
  EXPECT_NE(allowing.result.reason.find("allow for every known effect"), std::string::npos);
  const Vector6 error = minus(allowing.result.poses.front(), truth.poses.front());
  EXPECT_LT(error.dot(allowing.result.covariance->ldlt().solve(error)), 22.5);  // χ² of 6, 0.999
  for (int i = 0; i < 6; ++i) {
    const double deviation = allowing.result.standard_deviation[i];
    EXPECT_NEAR(deviation * deviation, (*allowing.result.covariance)(i, i), 1e-18);
  }
  // The lengths at the initial pose are those of its geometry, as far as effects leave it alone.
  const PlatformState state = platform_state(robot, allowing.result.poses.front());
  EXPECT_LE((allowing.result.initial_length_m - state.length_m()).norm(), 0.05);
}

TEST(AllowForEffects, AbsoluteSensorsAreInTheLargerModel) {
  // A tracker says where the platform is, whatever else may be wrong with the robot.
  const Robot robot = load_robot("irma4");
  const SyntheticLog truth = made(true);
  const Calibration allowing = calibrate_allowing_for_effects(robot, biased(truth.log));
  ASSERT_EQ(allowing.result.status, CalibrationStatus::converged) << allowing.result.reason;
  EXPECT_NE(allowing.result.reason.find("allow for every known effect"), std::string::npos);
  const Calibration without = calibrate_allowing_for_effects(robot, biased(made().log));
  EXPECT_LT(allowing.result.standard_deviation.head<3>().maxCoeff(), robot.sigma.position_m);
  EXPECT_GT(without.result.standard_deviation.head<3>().maxCoeff(), robot.sigma.position_m);
  const Vector6 error = minus(allowing.result.poses.front(), truth.poses.front());
  EXPECT_LT(error.dot(allowing.result.covariance->ldlt().solve(error)), 22.5);  // χ² of 6, 0.999
}

}  // namespace
}  // namespace cdprcal
