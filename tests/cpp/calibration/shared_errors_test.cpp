// Errors that moments in motion share with their neighbours.
#include "cdprcal/calibration/shared_errors.hpp"

#include <gtest/gtest.h>

#include "../support/run.hpp"
#include "cdprcal/calibration/online.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal::test {
namespace {

/// Residuals of four lengths, each what stays of the last and something new.
std::vector<PoseResidual> residuals(double stays, std::size_t count) {
  RandomNormal random(5);
  std::vector<PoseResidual> out(count);
  Eigen::Vector4d last = Eigen::Vector4d::Zero();
  for (PoseResidual& one : out) {
    for (double& value : last) value = stays * value + std::sqrt(1.0 - stays * stays) * random();
    one.length_m = last;
    one.wrench.setConstant(kNaN);
  }
  return out;
}

TEST(SharedErrors, AreWorthWhatTheirAutocorrelationSays) {
  const auto worth = [](double stays, std::size_t step) {
    constexpr std::size_t kCount = 4000;
    std::vector<std::size_t> moments;
    for (std::size_t i = 0; i < kCount; i += step) moments.push_back(i);
    return moments_a_reading(residuals(stays, kCount), moments);
  };
  EXPECT_EQ(worth(0.0, 1), 1.0);
  // Of a process of first order: (1 + a) / (1 - a).
  EXPECT_NEAR(worth(0.5, 1), 3.0, 0.4);
  EXPECT_NEAR(worth(0.8, 1), 9.0, 1.5);
  EXPECT_NEAR(worth(0.8, 2), (1.0 + 0.64) / (1.0 - 0.64), 0.8);
  EXPECT_EQ(moments_a_reading({}, {}), 1.0);
}

/// Errors of the lengths that wander from one value to the next in so many rows.
Log wandering(Log log, double sigma_m, Eigen::Index rows, std::uint64_t seed) {
  RandomNormal random(seed);
  for (Eigen::Index c = 0; c < log.length_m.cols(); ++c) {
    double from = 0.0, to = 0.0;
    for (Eigen::Index i = 0; i < log.sample_count(); ++i) {
      if (i % rows == 0) from = to, to = sigma_m * random();
      const double share = static_cast<double>(i % rows) / static_cast<double>(rows);
      log.length_m(i, c) += from + share * (to - from);
    }
  }
  return log;
}

TEST(SharedErrors, LeaveOneMomentOfThoseThatAreWorthOne) {
  const Robot robot = load_robot("irma4");
  const Log white = startup_log(robot, 0.2, 21, 1);
  CalibrateOptions specified;
  specified.noise = NoiseSource::specified;
  const int all = calibrate(robot, white, specified).kinematic_poses;
  EXPECT_EQ(calibrate(robot, white).kinematic_poses, all);
  const Log shared = wandering(white, 0.01, 100, 3);
  const int shared_all = calibrate(robot, shared, specified).kinematic_poses;
  const Calibration found = calibrate(robot, shared);
  ASSERT_EQ(found.result.status, CalibrationStatus::converged);
  EXPECT_LT(found.kinematic_poses, 2 * shared_all / 3);
  EXPECT_GE(found.kinematic_poses, 8);
  EXPECT_EQ(found.problem.measurements.size(),
            static_cast<std::size_t>(found.static_poses + found.kinematic_poses));
  EXPECT_EQ(found.result.poses.size(), found.problem.measurements.size());
}

/// Errors of the lengths that stay over each rest and half of the ways to it and from it.
Log constant_over_rests(Log log, double sigma_m, std::uint64_t seed) {
  constexpr Eigen::Index kPeriod = 80, kHalfAWay = 20;  // rows of run_through()
  RandomNormal random(seed);
  Eigen::RowVectorXd error = Eigen::RowVectorXd::Zero(log.length_m.cols());
  for (Eigen::Index i = 0; i < log.sample_count(); ++i) {
    if (i == 0 || (i + kHalfAWay) % kPeriod == 0) {
      for (double& value : error) value = sigma_m * random();
    }
    log.length_m.row(i) += error;
  }
  return log;
}

TEST(SharedErrors, WithTheRestsBesideLeaveHardlyAMoment) {
  const Robot robot = load_robot("irma4");
  const Log white = startup_log(robot, 0.1, 4, 0);
  const int all = calibrate(robot, white).kinematic_poses;
  EXPECT_GT(all, 8);
  const Log log = constant_over_rests(white, 0.01, 6);
  const Calibration found = calibrate(robot, log);
  ASSERT_EQ(found.result.status, CalibrationStatus::converged) << found.result.reason;
  EXPECT_EQ(found.static_poses, 8);
  EXPECT_LE(found.kinematic_poses, all / 4);
  // What they said again is no more than the rests say alone.
  CalibrateOptions statics;
  statics.method = Method::statics;
  const Vector6 ratio = found.result.standard_deviation().array() /
                        calibrate(robot, log, statics).result.standard_deviation().array();
  EXPECT_GT(ratio.minCoeff(), 0.7) << ratio.transpose();
}

/// Encoders alone of eight cables at twelve rests of four seconds and on the ways between, ten
/// readings a second. What a rest is wrong by passes linearly into what the next is.
Log encoders_alone(const Robot& robot, double shared_m, double white_m, std::uint64_t seed) {
  constexpr int kRests = 12, kRows = 40;
  RandomNormal random(seed);
  Eigen::Matrix<double, kRests, 6> places;
  Eigen::MatrixXd errors_m(kRests, robot.cable_count());
  for (double& value : places.reshaped()) value = 0.2 * std::clamp(random(), -2.0, 2.0);
  for (double& value : errors_m.reshaped()) value = shared_m * random();
  Log log;
  log.source = "eight.csv";
  const int count = (2 * kRests - 1) * kRows;
  log.time_s = 0.1 * Eigen::VectorXd::LinSpaced(count, 0.0, count - 1.0);
  log.length_m.resize(count, robot.cable_count());
  for (int i = 0; i < count; ++i) {
    const int from = i / (2 * kRows), to = std::min(from + 1, kRests - 1);
    const double way = std::max(0.0, (i % (2 * kRows)) / static_cast<double>(kRows) - 1.0);
    const Vector6 place = (1.0 - way) * places.row(from) + way * places.row(to);
    Pose pose;
    pose.position_m = Vector3(0.0, 0.0, 1.0) + place.head<3>();
    pose.rotation = exp_so3(place.tail<3>());
    log.length_m.row(i) = platform_state(robot, pose).length_m().transpose() +
                          (1.0 - way) * errors_m.row(from) + way * errors_m.row(to);
    for (double& value : log.length_m.row(i)) value += white_m * random();
  }
  log.length_m.rowwise() -= log.length_m.row(0).eval();
  return log;
}

TEST(SharedErrors, OfMomentsMakeNoPoseSurerThanItsRestsDo) {
  const Robot robot = load_robot("posts8");
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE(seed);
    const Calibration whole = calibrate(robot, encoders_alone(robot, 5e-4, 5e-4, seed));
    ASSERT_EQ(whole.result.status, CalibrationStatus::converged) << whole.result.reason;
    ASSERT_GE(whole.kinematic_poses, 4);
    CalibrationProblem rests = whole.problem;
    rests.measurements.clear();
    std::vector<Pose> poses;
    for (std::size_t i = 0; i < whole.result.poses.size(); ++i) {
      const Measurement& m = whole.problem.measurements[i];
      if (m.kind == PoseKind::kinematic_pose) continue;
      rests.measurements.push_back(m);
      poses.push_back(whole.result.poses[i]);
    }
    const CalibrationResult alone = solve(rests, poses);
    ASSERT_EQ(alone.status, CalibrationStatus::converged) << alone.reason;
    const Vector6 ratio =
        whole.result.standard_deviation().cwiseQuotient(alone.standard_deviation());
    EXPECT_GT(ratio.minCoeff(), 0.999) << ratio.transpose();
  }
}

TEST(SharedErrors, AreOnesOfARunThatIsMeasuredToo) {
  const Robot robot = load_robot("irma4");
  const Log shared = wandering(startup_log(robot, 0.2, 21, 1), 0.01, 100, 3);
  OnlineCalibration online(robot);
  const Calibration whole = calibrate(robot, shared);
  Eigen::Index begin = 0;
  for (const Equilibrium& rest : whole.equilibria) {
    online.add(cut(shared, begin, rest.samples.end - begin));
    begin = rest.samples.end;
  }
  const Calibration& live = online.calibration();
  ASSERT_EQ(live.result.status, CalibrationStatus::converged) << live.result.reason;
  EXPECT_EQ(live.problem.measurements.size(), live.result.poses.size());
  EXPECT_EQ(live.problem.measurements.size(),
            static_cast<std::size_t>(live.static_poses + live.kinematic_poses));
  EXPECT_LT(live.kinematic_poses, 2 * whole.kinematic_poses);
  const Vector6 ratio =
      live.result.standard_deviation().array() / whole.result.standard_deviation().array();
  EXPECT_GT(ratio.minCoeff(), 0.6) << ratio.transpose();
  EXPECT_LT(ratio.maxCoeff(), 1.6) << ratio.transpose();
}

}  // namespace
}  // namespace cdprcal::test
