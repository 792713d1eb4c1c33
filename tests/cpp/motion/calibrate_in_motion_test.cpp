// The balance in motion: what a short run, and one without rests, say of the initial pose.
#include "cdprcal/motion/calibrate_in_motion.hpp"

#include <gmock/gmock.h>

#include "../support/startup_scenario.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/motion/middle_readings.hpp"
#include "cdprcal/motion/smoothed.hpp"

namespace cdprcal::test {
namespace {

/// A run's first seconds.
Log cut(const Log& log, double until_s) {
  Eigen::Index rows = 0;
  while (rows < log.sample_count() && log.time_s[rows] - log.time_s[0] <= until_s) ++rows;
  Log out = log;
  out.time_s = log.time_s.head(rows).eval();
  for (LogMatrix* values : out.groups()) {
    if (values->cols() > 0) *values = values->topRows(rows).eval();
  }
  return out;
}

/// As the data sheets say (eq. 18), about: twelve times what the simulated sensors have.
SensorOptions coarse_sensors() {
  SensorOptions out;
  for (SensorChannel* channel :
       {&out.length_m, &out.swivel_rad, &out.tension_N, &out.roll_pitch_rad, &out.yaw_rad}) {
    channel->noise *= 12.0;
  }
  return out;
}

StartUpRun coarse_run(const Robot& robot, std::uint64_t seed) {
  StartUpPlan plan;
  plan.setpoint_N = default_setpoints(robot, 2, 2, 1);
  StartUpRunOptions options;
  options.log_rate_Hz = 20.0;
  options.simulator.seed = seed;
  options.simulator.sensors = coarse_sensors();
  return simulate_startup(robot, plan, options);
}

/// Winches locked, set swinging: from half a second on, with the truth at its first sample.
std::pair<Log, Pose> swing(const Robot& robot, double push_m_s, std::uint64_t seed) {
  SimulatorOptions options;
  options.seed = seed;
  options.winch.mode = WinchMode::velocity;
  options.damping = {20.0, 20.0};
  Simulator simulator(robot, options);
  const RestResult rest = simulator.reset(default_setpoints(robot, 3, 3, 3)[7 * seed % 27]);
  EXPECT_TRUE(rest.found) << rest.reason;
  simulator.hold();
  simulator.push({push_m_s, -0.7 * push_m_s, 0.0}, push_m_s * Vector3(1.0, -1.5, 0.5));
  simulator.advance(0.5);
  const Pose initial = simulator.truth().pose;
  constexpr Eigen::Index kSamples = 2500;
  const int n = robot.cable_count();
  Log log;
  log.source = "swing.csv";
  log.time_s.resize(kSamples);
  for (LogMatrix* values : {&log.length_m, &log.swivel_rad, &log.tension_N}) {
    values->resize(kSamples, n);
  }
  log.roll_pitch_yaw_rad.resize(kSamples, 3);
  for (Eigen::Index k = 0; k < kSamples; ++k) {
    const RobotSample sample = simulator.read();
    log.time_s[k] = 0.01 * static_cast<double>(k);
    log.length_m.row(k) = sample.length_m;
    log.swivel_rad.row(k) = sample.swivel_rad;
    log.tension_N.row(k) = sample.tension_N;
    log.roll_pitch_yaw_rad.row(k) = sample.roll_pitch_yaw_rad;
    simulator.advance(0.01);
  }
  return {log, initial};
}

TEST(InMotion, ShortRunsSayMoreThanTheirRestsAlone) {
  const Robot robot = load_robot("irma4");
  double rests_m2 = 0.0, motion_m2 = 0.0;
  for (const std::uint64_t seed : {1, 2, 3, 4, 5, 6}) {
    const StartUpRun run = coarse_run(robot, seed);
    const Log log = cut(run.log, 15.0);
    const Calibration rests = calibrate(robot, log);
    const InMotion found = calibrate_in_motion(robot, log);
    ASSERT_TRUE(found.in_motion) << found.calibration.result.reason;
    EXPECT_GT(found.calibration.kinematic_poses, 10);
    // The simulated platform's: its decays are of one second.
    EXPECT_NEAR(found.beside.damping_1_s[0], 1.0, 0.4);
    const Vector6 error = minus(found.calibration.result.poses[0], run.truth[0].pose);
    EXPECT_LT(error.dot(solve_symmetric(*found.calibration.result.covariance, error)),
              22.5);  // 99.9 %
    EXPECT_LT(error.head<3>().norm(), 15e-3);
    EXPECT_LT(error.tail<3>().norm(), 0.5 * kDegree);
    rests_m2 += minus(rests.result.poses[0], run.truth[0].pose).head<3>().squaredNorm();
    motion_m2 += error.head<3>().squaredNorm();
  }
  EXPECT_LT(motion_m2, 0.8 * rests_m2);
}

TEST(InMotion, FindsWhichSensorIsLateAndByHowMuch) {
  const Robot robot = load_robot("irma4");
  for (const char* late : {"", "sensor_delay", "length_delay", "swivel_delay", "tension_delay"}) {
    constexpr double kDelay_s = 0.04;
    const bool none = *late == '\0';
    StartUpPlan plan;
    plan.setpoint_N = default_setpoints(robot, 2, 2, 1);
    StartUpRunOptions options;
    options.log_rate_Hz = 100.0;
    options.startup.wait_for_rest = false;
    if (!none) options.simulator.effects = {{late, {kDelay_s}}};
    const StartUpRun run = simulate_startup(robot, plan, options);
    const InMotion found = calibrate_in_motion(robot, run.log);
    ASSERT_TRUE(found.in_motion) << found.calibration.result.reason;
    ASSERT_EQ(found.beside.late.size(), none ? 0U : 1U) << late;
    if (!none) {
      EXPECT_EQ(found.beside.late[0].effect->name(), late);
      EXPECT_NEAR(found.beside.late[0].values[0], kDelay_s, 0.01) << late;
    }
    const CalibrationResult& result = found.calibration.result;
    const Vector6 error = minus(result.poses[0], run.truth[0].pose);
    EXPECT_LT(error.dot(solve_symmetric(*result.covariance, error)), 22.5) << late;  // 99.9 %
  }
}

TEST(InMotion, AnAttitudeThatIsHeldIsNotLate) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    StartUpPlan plan;
    const Robot robot = load_robot("irma4");
    plan.setpoint_N = default_setpoints(robot, 2, 2, 1);
    StartUpRunOptions options;
    options.log_rate_Hz = 100.0;
    options.simulator.seed = seed;
    options.simulator.sensors.roll_pitch_rad.rate_Hz = 20.0;
    options.simulator.sensors.yaw_rad.rate_Hz = 20.0;
    const Log log = cut(simulate_startup(robot, plan, options).log, 25.0);
    const InMotion found = calibrate_in_motion(robot, log);
    ASSERT_TRUE(found.in_motion) << found.calibration.result.reason;
    for (const ActiveEffect& late : found.beside.late) {
      EXPECT_LT(std::abs(late.values[0]), 0.008) << "held for 50 ms";
    }
  }
}

TEST(InMotion, WholeRunsStayAsGood) {
  const Robot robot = ring_robot(3);
  InMotionOptions options;
  options.calibrate.allow_for_effects =
      false;  // what these may do is judged anew, by other moments
  constexpr std::uint64_t kRuns = 6;
  double squares = 0.0;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    const StartUpRun run = coarse_run(robot, seed);
    const CalibrationResult rests = calibrate(robot, run.log, options.calibrate).result;
    const CalibrationResult motion =
        calibrate_in_motion(robot, run.log, options).calibration.result;
    ASSERT_EQ(motion.status, CalibrationStatus::converged) << motion.reason;
    const Vector6 apart = minus(motion.poses[0], rests.poses[0]);
    const double most = (apart.array().abs() / rests.standard_deviation().array()).maxCoeff();
    squares += most * most;
    const Vector6 error = minus(motion.poses[0], run.truth[0].pose);
    EXPECT_LT(error.dot(solve_symmetric(*motion.covariance, error)), 22.5);  // 99.9 %
    // The noise is learnt from either's residuals.
    EXPECT_LT((motion.standard_deviation().array() / rests.standard_deviation().array()).maxCoeff(),
              1.03);
  }
  EXPECT_LT(std::sqrt(squares / kRuns), 1.5);  // of one run it is a draw
}

TEST(InMotion, SwingsOfAPlatformThatNeverRestsAreEnough) {
  const Robot robot = load_robot("irma4");
  for (const std::uint64_t seed : {1, 3}) {
    const auto [log, initial] = swing(robot, 0.04, seed);
    const InMotion found = calibrate_in_motion(robot, log);
    ASSERT_TRUE(found.in_motion) << found.calibration.result.reason;
    const CalibrationResult& result = found.calibration.result;
    const Vector6 error = minus(result.poses[0], initial);
    EXPECT_LT((error.array().abs() / result.standard_deviation().array()).maxCoeff(), 4.0);
    EXPECT_LT(error.head<3>().norm(), 10e-3);
    for (const Swing& mode : found.swings) {
      if (std::isfinite(mode.measured_hz)) {
        EXPECT_NEAR(mode.measured_hz / mode.model_hz, 1.0, 0.05);
      }
    }
  }
}

TEST(InMotion, ACableThatHangsIsNoticedWhateverALoadCellMisses) {
  const Robot robot = load_robot("irma4");
  Log log = swing(robot, 0.04, 2).first;
  log.tension_N.col(1).segment(800, 600).setZero();
  const int whole = calibrate_in_motion(robot, log, {}).calibration.kinematic_poses;
  log.tension_N(2300, 3) = kNaN;
  const int missed = calibrate_in_motion(robot, log, {}).calibration.kinematic_poses;
  EXPECT_GT(whole, 10);
  EXPECT_LE(missed, whole);
  EXPECT_GE(missed, whole - 2);
}

TEST(InMotion, SaysWhatRestsSayWhereMotionAddsNothing) {
  const Robot robot = load_robot("irma4");
  Log log = cut(coarse_run(robot, 1).log, 12.0);
  log.swivel_rad *= -1.0;  // wired the wrong way round
  const CalibrationResult rests = calibrate(robot, log).result;
  const InMotion found = calibrate_in_motion(robot, log);
  ASSERT_FALSE(found.in_motion);
  EXPECT_EQ(found.calibration.result.status, rests.status);
  EXPECT_THAT(found.calibration.result.reason, ::testing::StartsWith(rests.reason));
}

TEST(InMotion, RefusesOptionsThatLeaveMotionOut) {
  const Robot robot = load_robot("irma4");
  const Log log = cut(coarse_run(robot, 1).log, 12.0);
  const auto refused = [&](const auto& change) {
    InMotionOptions options;
    change(options);
    EXPECT_THROW(calibrate_in_motion(robot, log, options), InputError);
  };
  refused([](InMotionOptions& o) { o.calibrate.method = Method::statics; });
  refused([](InMotionOptions& o) { o.calibrate.formulation = Formulation::paper; });
  refused([](InMotionOptions& o) { o.calibrate.noise = NoiseSource::specified; });
  refused([](InMotionOptions& o) { o.calibrate.at_s = {0.0, 5.0}; });
  refused([](InMotionOptions& o) { o.most_moments = 0; });
  refused([](InMotionOptions& o) { o.spacing = 0.0; });
  refused([](InMotionOptions& o) { o.rounds = 0; });
  EXPECT_THROW(calibrate_in_motion(load_robot("ring3"), log), InputError);
}

TEST(Smoothed, KnowsTheMotionBetterThanTheFilter) {
  const Robot robot = load_robot("irma4");
  StartUpPlan plan;
  plan.setpoint_N = default_setpoints(robot, 2, 1, 1);
  StartUpRunOptions options;
  options.log_rate_Hz = 50.0;
  const StartUpRun run = simulate_startup(robot, plan, options);
  const Calibration calibration = calibrate(robot, run.log);
  const Track filtered = track(calibration, run.log);
  const std::vector<SmoothedSample> path = smoothed(calibration, CorrectedRun(robot, run.log));
  ASSERT_EQ(path.size(), run.truth.size());
  double before = 0.0, after = 0.0, chi_squared = 0.0;
  for (std::size_t k = 50; k < path.size(); ++k) {
    const Vector6 error = path[k].state.twist - run.truth[k].twist;
    before += (filtered.samples[k].state.twist - run.truth[k].twist).squaredNorm();
    after += error.squaredNorm();
    const Matrix6 covariance = path[k].covariance.block<6, 6>(6, 6);
    chi_squared += error.dot(solve_symmetric(covariance, error));
  }
  EXPECT_LT(after, 0.5 * before);
  EXPECT_LT(chi_squared / static_cast<double>(path.size() - 50), 12.0);  // 6 where all is right
}

TEST(MiddleReading, IsExactOfParabolas) {
  constexpr Eigen::Index kSamples = 21;
  Log log;
  log.time_s = Eigen::VectorXd::LinSpaced(kSamples, 0.0, 1.0);
  log.length_m.resize(kSamples, 3);
  log.roll_pitch_yaw_rad.resize(kSamples, 3);
  const auto at = [](double time_s, double bend) {
    return 0.3 + 0.2 * time_s + bend * time_s * time_s;
  };
  for (Eigen::Index k = 0; k < kSamples; ++k) {
    for (Eigen::Index c = 0; c < 3; ++c) {
      const auto bend = static_cast<double>(c);
      log.length_m(k, c) = at(log.time_s[k], bend);
      log.roll_pitch_yaw_rad(k, c) = wrap_angle(2.8 + at(log.time_s[k], bend));
    }
  }
  const SampleRange run{0, kSamples};
  log.tension_N = log.length_m;
  CableVector rate_N_s;
  const Measurement m = middle_reading(log, run, 10, 0.25, 3, rate_N_s);
  for (Eigen::Index c = 0; c < 3; ++c) {
    EXPECT_NEAR(m.length_m[c], log.length_m(10, c), 1e-12);
    EXPECT_NEAR(wrap_angle(m.roll_pitch_yaw_rad[c] - log.roll_pitch_yaw_rad(10, c)), 0.0, 1e-12);
    EXPECT_NEAR(rate_N_s[c], 0.2 + 2.0 * static_cast<double>(c) * log.time_s[10], 1e-9);
  }
  EXPECT_EQ(m.samples, 4);  // 11 readings: the middle of a parabola has 0.207 of their variance
  EXPECT_EQ(middle_reading(log, run, 0, 0.25, 3, rate_N_s).samples, 1);  // nothing before it
  EXPECT_EQ(rate_N_s, CableVector::Zero(3));
  log.length_m(9, 1) = kNaN;
  EXPECT_EQ(middle_reading(log, run, 10, 0.25, 3, rate_N_s).length_m[1], log.length_m(10, 1));
}

}  // namespace
}  // namespace cdprcal::test
