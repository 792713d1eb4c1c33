// Pose and twist at every sample of simulated start-ups, whose truth is known.
#include "cdprcal/motion/tracker.hpp"

#include <gmock/gmock.h>

#include <random>

#include "../support/startup_scenario.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/error.hpp"
#include "support/refusal.hpp"

namespace cdprcal::test {
namespace {

StartUpRun simulated(const Robot& robot, double rate_Hz, std::uint64_t seed,
                     StartUpRunOptions options = {}) {
  StartUpPlan plan;
  plan.setpoint_N = default_setpoints(load_robot(robot.name), 2, 2, 1);
  options.log_rate_Hz = rate_Hz;
  options.simulator.seed = seed;
  StartUpRun run = simulate_startup(robot, plan, options);
  EXPECT_EQ(run.state, StartUpState::done) << run.reason;
  return run;
}

Robot irma4_with(const std::string& effect) {
  return parse_robot(builtin_robot_yaml("irma4") + "\neffects:\n  - " + effect + "\n",
                     "robot.yaml");
}

Vector6 error_of(const TrackedSample& tracked, const PlantTruth& truth) {
  return minus(truth.pose, tracked.state.pose);
}

/// How tracks of several runs compare with the truth.
struct Score {
  double rows = 0.0, position = 0.0, rotation = 0.0, chi_squared = 0.0;
  double velocity = 0.0, rate = 0.0, later_rows = 0.0;

  void add(const Track& track, const std::vector<PlantTruth>& truth) {
    ASSERT_EQ(track.samples.size(), truth.size());
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const TrackedSample& now = track.samples[i];
      ASSERT_TRUE(now.trusted) << now.time_s << " s: " << now.reason;
      const Vector6 error = error_of(now, truth[i]);
      const Vector6 sigma = now.pose_covariance.diagonal().cwiseSqrt();
      const auto within = (error.array().abs() < 1.96 * sigma.array()).cast<double>();
      rows += 1.0;
      position += within.head<3>().mean();
      rotation += within.tail<3>().mean();
      chi_squared += error.dot(solve_symmetric(now.pose_covariance, error));
      if (now.time_s < track.samples.front().time_s + 1.0) continue;  // a twist takes a moment
      later_rows += 1.0;
      const Vector6 twist = now.state.twist - truth[i].twist;
      velocity += twist.head<3>().squaredNorm();
      rate += twist.tail<3>().squaredNorm();
    }
  }
  void expect_covered() const {
    EXPECT_GT(position / rows, 0.90);
    EXPECT_LT(position / rows, 0.995);
    EXPECT_GT(rotation / rows, 0.90);
    EXPECT_LT(rotation / rows, 0.99);
    EXPECT_GT(chi_squared / rows, 3.5);
    EXPECT_LT(chi_squared / rows, 8.0);
  }
  [[nodiscard]] double velocity_rms() const { return std::sqrt(velocity / later_rows); }
  [[nodiscard]] double rate_rms() const { return std::sqrt(rate / later_rows); }
};

Score score_of(const Robot& robot, double rate_Hz, int seeds,
               const StartUpRunOptions& options = {}) {
  Score score;
  for (int seed = 1; seed <= seeds; ++seed) {
    SCOPED_TRACE(robot.name + " seed " + std::to_string(seed));
    const StartUpRun run = simulated(robot, rate_Hz, static_cast<std::uint64_t>(seed), options);
    score.add(track(calibrate(robot, run.log), run.log), run.truth);
  }
  return score;
}

/// The longest time for which a wrong pose (an axis off by more than 6 σ) is trusted.
double silently_wrong_s(const std::vector<TrackedSample>& samples,
                        const std::vector<PlantTruth>& truth) {
  double longest = 0.0, since = kNaN;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Vector6 sigma = samples[i].pose_covariance.diagonal().cwiseSqrt();
    const bool wrong = (error_of(samples[i], truth[i]).array().abs() > 6.0 * sigma.array()).any();
    if (!wrong || !samples[i].trusted) {
      since = kNaN;
      continue;
    }
    if (std::isnan(since)) since = samples[i].time_s;
    longest = std::max(longest, samples[i].time_s - since);
  }
  return longest;
}

/// All samples of a log, streamed.
std::vector<TrackedSample> streamed(const Calibration& calibration, const Log& log) {
  Tracker tracker(calibration);
  std::vector<TrackedSample> out;
  for (Eigen::Index row = 0; row < log.sample_count(); ++row) {
    out.push_back(tracker.add(measurement_at(log, row, PoseKind::kinematic_pose,
                                             calibration.problem.robot.cable_count())));
  }
  return out;
}

TEST(Tracker, SaysHowWellItKnowsThePose) {
  for (const Robot& robot : {load_robot("irma4"), ring_robot(3), ring_robot(5)}) {
    SCOPED_TRACE(robot.name);
    const Score score = score_of(robot, 100.0, 4);
    score.expect_covered();
    EXPECT_LT(score.velocity_rms(), 0.01);
    EXPECT_LT(score.rate_rms(), 0.08);
  }
}

TEST(Tracker, TakesASlowLog) {
  const Score score = score_of(load_robot("irma4"), 10.0, 4);
  score.expect_covered();
  EXPECT_LT(score.velocity_rms(), 0.02);
  EXPECT_LT(score.rate_rms(), 0.08);
}

TEST(Tracker, ReadsWithTheEffectsOfTheRobotFile) {
  for (const char* effect : {"{name: transmission_ratio, ratio_error: [0.02, -0.01, 0.015, 0.01]}",
                             "{name: swivel_scale, scale_error: [0.03, -0.02, 0.01, 0.02]}"}) {
    for (const double rate_Hz : {100.0, 10.0}) {
      SCOPED_TRACE(effect + std::to_string(rate_Hz));
      score_of(irma4_with(effect), rate_Hz, 3).expect_covered();
    }
  }
}

/// The largest of what a pose and a twist are off by, in their σ, where they are trusted.
std::pair<double, double> most_off(const Track& track, const std::vector<PlantTruth>& truth) {
  std::pair<double, double> out{0.0, 0.0};
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const TrackedSample& now = track.samples[i];
    if (!now.trusted) continue;
    const auto sizes = [](const Vector6& error, const Matrix6& covariance) {
      return error.cwiseQuotient(covariance.diagonal().cwiseSqrt()).cwiseAbs().maxCoeff();
    };
    const Vector6 twist_error = now.state.twist - truth[i].twist;
    out.first = std::max(out.first, sizes(error_of(now, truth[i]), now.pose_covariance));
    out.second = std::max(out.second, sizes(twist_error, now.twist_covariance));
  }
  return out;
}

TEST(Tracker, MotionThatBeginsIsWithinItsSigma) {
  const Robot robot = load_robot("irma4");
  for (const double rate_Hz : {20.0, 100.0}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      SCOPED_TRACE(std::to_string(rate_Hz) + " " + std::to_string(seed));
      const StartUpRun run = simulated(robot, rate_Hz, seed);
      const auto [pose, twist] = most_off(track(calibrate(robot, run.log), run.log), run.truth);
      EXPECT_LT(pose, 5.5);
      EXPECT_LT(twist, 8.0);
    }
  }
}

TEST(Tracker, StartsAtRestThoughTheAttitudeIsKnownToBeLate) {
  const Robot robot = irma4_with("{name: sensor_delay, delay_s: 0.02}");
  for (const double rate_Hz : {20.0, 100.0}) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      SCOPED_TRACE(std::to_string(rate_Hz) + " " + std::to_string(seed));
      const StartUpRun run = simulated(load_robot("irma4"), rate_Hz, seed);
      const Track found = track(calibrate(robot, run.log), run.log);
      for (std::size_t i = 0; i < 10; ++i) {
        const TrackedSample& now = found.samples[i];
        const Vector6 sigma = now.twist_covariance.diagonal().cwiseSqrt();
        EXPECT_LT(now.state.twist.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 5.0) << i;
      }
      for (const TrackedSample& now : found.samples) {
        ASSERT_GT(now.pose_covariance.diagonal().minCoeff(), 0.0) << now.time_s;
        ASSERT_GT(now.twist_covariance.diagonal().minCoeff(), 0.0) << now.time_s;
      }
    }
  }
}

TEST(Tracker, FollowsAnAttitudeThatIsKnownToBeLate) {
  for (const double delay_s : {0.02, 0.08}) {
    SCOPED_TRACE(delay_s);
    const Robot robot =
        irma4_with("{name: sensor_delay, delay_s: " + std::to_string(delay_s) + "}");
    score_of(robot, 100.0, 2).expect_covered();
  }
}

TEST(Tracker, TakesAHeldAttitudeOnce) {
  StartUpRunOptions options;
  options.simulator.sensors.roll_pitch_rad.rate_Hz = 10.0;
  options.simulator.sensors.yaw_rad.rate_Hz = 10.0;
  score_of(load_robot("irma4"), 100.0, 4, options).expect_covered();
}

TEST(Tracker, NeedsNoLoadCells) {
  const Robot robot = load_robot("irma4");
  StartUpRun run = simulated(robot, 100.0, 1);
  const Calibration calibration = calibrate(robot, run.log);
  run.log.tension_N.resize(run.log.sample_count(), 0);
  Score score;
  score.add(track(calibration, run.log), run.truth);
  score.expect_covered();
}

TEST(Tracker, KnowsTheMotionBetterByAnInertialUnit) {
  for (const Robot& robot : {load_robot("irma4"), ring_robot(3), ring_robot(5)}) {
    for (const double rate_Hz : {100.0, 10.0}) {
      SCOPED_TRACE(robot.name + " " + std::to_string(rate_Hz));
      const Score plain = score_of(robot, rate_Hz, 2);
      const Score with = score_of(with_inertial_unit(robot), rate_Hz, 2);
      EXPECT_GT(with.position / with.rows, 0.90);
      EXPECT_GT(with.rotation / with.rows, 0.90);
      EXPECT_LT(with.chi_squared / with.rows, 8.0);
      EXPECT_LT(with.velocity_rms(), 1.02 * plain.velocity_rms());
      EXPECT_LT(with.rate_rms(), 0.3 * plain.rate_rms());
    }
  }
}

TEST(Tracker, GoesOnByAnInertialUnitWhereReadingsAreFew) {
  const Robot robot = with_inertial_unit(load_robot("irma4"));
  StartUpRun run = simulated(robot, 100.0, 3);
  const Calibration calibration = calibrate(robot, run.log);
  // Two cables' encoders and the attitude are silent for half a second, now and then.
  for (Eigen::Index row = 200; row + 50 < run.log.sample_count(); row += 200) {
    run.log.length_m.block(row, 0, 50, 2).setConstant(kNaN);
    run.log.swivel_rad.block(row, 0, 50, 4).setConstant(kNaN);
    run.log.roll_pitch_yaw_rad.middleRows(row, 50).setConstant(kNaN);
  }
  const Track with = track(calibration, run.log);
  for (LogMatrix* m : {&run.log.specific_force_m_s2, &run.log.angular_velocity_rad_s}) {
    m->setConstant(kNaN);
  }
  const Track without = track(calibration, run.log);
  double within = 0.0, squares = 0.0, squares_without = 0.0, rows = 0.0;
  for (Eigen::Index row = 249; row < run.log.sample_count(); row += 200) {
    const auto i = static_cast<std::size_t>(row);
    ASSERT_TRUE(with.samples[i].trusted) << with.samples[i].reason;
    const Vector6 error = error_of(with.samples[i], run.truth[i]);
    const Vector6 sigma = with.samples[i].pose_covariance.diagonal().cwiseSqrt();
    within += (error.array().abs() < 1.96 * sigma.array()).cast<double>().mean();
    squares += error.squaredNorm();
    squares_without += error_of(without.samples[i], run.truth[i]).squaredNorm();
    rows += 1.0;
  }
  ASSERT_GE(rows, 10.0);
  EXPECT_GT(within / rows, 0.85);
  EXPECT_LT(squares, 0.1 * squares_without);
}

TEST(Tracker, LeavesASpikeOut) {
  for (const Robot& robot : {load_robot("irma4"), ring_robot(3), ring_robot(5)}) {
    SCOPED_TRACE(robot.name);
    StartUpRun run = simulated(robot, 100.0, 5);
    const Calibration calibration = calibrate(robot, run.log);
    const Track clean = track(calibration, run.log);
    const Eigen::Index row = run.log.sample_count() / 2;
    run.log.swivel_rad(row, 1) += 10.0 * kDegree;
    const Track spiked = track(calibration, run.log);
    for (std::size_t i = 0; i < clean.samples.size(); ++i) {
      const TrackedSample& now = spiked.samples[i];
      EXPECT_TRUE(now.trusted);
      const int before = clean.samples[i].left_out;
      EXPECT_EQ(now.left_out, before + (static_cast<Eigen::Index>(i) == row ? 1 : 0)) << i;
      const Vector6 moved = minus(now.state.pose, clean.samples[i].state.pose);
      EXPECT_LT(moved.head<3>().norm(), 1e-4);
      EXPECT_LT(moved.tail<3>().norm(), 0.02 * kDegree);
    }
  }
}

TEST(Tracker, DoesNotTrustACableThatSlipped) {
  for (const Robot& robot : {load_robot("irma4"), ring_robot(3), ring_robot(5)}) {
    const StartUpRun run = simulated(robot, 100.0, 6);
    const Calibration calibration = calibrate(robot, run.log);
    for (int cable = 0; cable < robot.cable_count(); ++cable) {
      SCOPED_TRACE(robot.name + " cable " + std::to_string(cable + 1));
      Log log = run.log;
      const Eigen::Index slip = log.sample_count() / 2;
      log.length_m.col(cable).tail(log.sample_count() - slip).array() += 0.02;
      const Track slipped = track(calibration, log);
      const auto begin = slipped.samples.begin() + slip;
      const auto noticed = std::find_if(begin, slipped.samples.end(),
                                        [](const TrackedSample& s) { return !s.trusted; });
      ASSERT_NE(noticed, slipped.samples.end());
      EXPECT_LT(noticed->time_s - begin->time_s, 1.0);
      EXPECT_THAT(noticed->reason,
                  testing::ContainsRegex("(length_[1-5]_m|swivel_[1-5]_rad|roll_rad|pitch_rad|"
                                         "yaw_rad) contradicts the other readings"));
      EXPECT_LE(silently_wrong_s(slipped.samples, run.truth), 1.0);
    }
  }
}

TEST(Tracker, SeesASlipThatHidesInTheNoise) {
  const Robot robot = load_robot("irma4");
  const StartUpRun run = simulated(robot, 100.0, 9);
  const Calibration calibration = calibrate(robot, run.log);
  for (int cable = 0; cable < robot.cable_count(); ++cable) {
    SCOPED_TRACE(cable + 1);
    Log log = run.log;
    const Eigen::Index slip = log.sample_count() / 2;
    log.length_m.col(cable).tail(log.sample_count() - slip).array() += 8e-3;
    EXPECT_LE(silently_wrong_s(track(calibration, log).samples, run.truth), 0.5);
  }
}

TEST(Tracker, ReadsNoSensorThatIsStuck) {
  const Robot robot = load_robot("irma4");
  const StartUpRun run = simulated(robot, 100.0, 10);
  const Calibration calibration = calibrate(robot, run.log);
  Log log = run.log;
  const Eigen::Index row = log.sample_count() / 2, count = 150;
  for (Eigen::Index i = row + 1; i < row + count; ++i) {
    log.roll_pitch_yaw_rad.row(i) = log.roll_pitch_yaw_rad.row(row);
  }
  const Track stuck = track(calibration, log);
  EXPECT_LE(silently_wrong_s(stuck.samples, run.truth), 0.1);
  const Track whole = track(calibration, run.log);
  const auto during = static_cast<std::size_t>(row + count / 2);
  EXPECT_GT(stuck.samples[during].pose_covariance.trace(),
            2.0 * whole.samples[during].pose_covariance.trace());
  EXPECT_TRUE(stuck.samples.back().trusted) << stuck.samples.back().reason;
}

TEST(Tracker, ReadsNoColumnThatIsStuckBesideOthersThatAreHeld) {
  const Robot robot = load_robot("irma4");
  StartUpRunOptions options;
  options.simulator.sensors.roll_pitch_rad.rate_Hz = 25.0;
  options.simulator.sensors.yaw_rad.rate_Hz = 25.0;
  const StartUpRun run = simulated(robot, 100.0, 10, options);
  const Calibration calibration = calibrate(robot, run.log);
  Log log = run.log;
  const Eigen::Index row = log.sample_count() / 3;
  log.roll_pitch_yaw_rad.col(0).segment(row, row).setConstant(log.roll_pitch_yaw_rad(row, 0));
  const Track stuck = track(calibration, log);
  EXPECT_LE(silently_wrong_s(stuck.samples, run.truth), 0.1);
  EXPECT_TRUE(stuck.samples.back().trusted) << stuck.samples.back().reason;
}

/// A path that goes on from the end of a run, in circles that sink by half the frame.
Log in_circles(const Robot& robot, const StartUpRun& run, double lasts_s,
               std::vector<PlantTruth>& truth) {
  const SampleRange last{run.log.sample_count() - 100, run.log.sample_count()};
  const auto rows = static_cast<Eigen::Index>(100.0 * lasts_s);
  Log log = log_of(std::vector<Measurement>(
      static_cast<std::size_t>(rows),
      measurement_mean(run.log, last, PoseKind::kinematic_pose, robot.cable_count())));
  const Pose begin = run.truth.back().pose;
  const PlatformState first = platform_state(robot, begin);
  const double size_m = robot_size_m(robot);
  std::mt19937_64 random(4);
  const auto noise = [&](double sigma) {
    return std::normal_distribution<double>(0.0, 0.02 * sigma)(random);
  };
  for (Eigen::Index row = 0; row < rows; ++row) {
    const double t = 0.01 * static_cast<double>(row), turn = 2.0 * kPi * t / 3.0;
    Vector6 by = Vector6::Zero();
    by.head<3>() = 0.15 * size_m * Vector3(std::sin(turn), 1.0 - std::cos(turn), 0.0);
    by[2] = -0.1 * size_m * (1.0 - std::cos(2.0 * kPi * t / lasts_s));
    by[3] = 0.2 * std::sin(turn);
    const Pose pose = plus(begin, by);
    const PlatformState state = platform_state(robot, pose);
    log.time_s[row] = run.log.time_s[last.end - 1] + t + 0.01;
    for (int i = 0; i < robot.cable_count(); ++i) {
      log.length_m(row, i) +=
          state.length_m()[i] - first.length_m()[i] + noise(robot.sigma.length_m);
      log.swivel_rad(row, i) +=
          state.swivel_rad()[i] - first.swivel_rad()[i] + noise(robot.sigma.swivel_rad);
    }
    const Vector3 angles = euler_from_rotation(state.rotation, robot.euler_convention) -
                           euler_from_rotation(first.rotation, robot.euler_convention);
    for (int i = 0; i < 3; ++i) {
      log.roll_pitch_yaw_rad(row, i) += angles[i] + noise(robot.sigma.attitude_rad);
    }
    truth.emplace_back().pose = pose;
  }
  return log;
}

TEST(Tracker, APoseThatWasLeftOpenIsClosedByReadingsThatDetermineIt) {
  for (const Robot& robot : {ring_robot(3), load_robot("irma4")}) {
    SCOPED_TRACE(robot.name);
    const StartUpRun run = simulated(robot, 100.0, 3);
    const Calibration calibration = calibrate(robot, run.log);
    std::vector<PlantTruth> truth;
    Log log = in_circles(robot, run, 30.0, truth);
    log.length_m.middleRows(300, 2400).setConstant(kNaN);
    const std::vector<TrackedSample> found = streamed(calibration, log);
    EXPECT_LE(silently_wrong_s(found, truth), 0.6);
    for (std::size_t i = 400; i < 2700; ++i) EXPECT_FALSE(found[i].trusted) << i;
    EXPECT_TRUE(found.back().trusted) << found.back().reason;
  }
}

TEST(Tracker, AYawThatJumpedStaysOut) {
  const Robot robot = load_robot("irma4");
  const StartUpRun run = simulated(robot, 50.0, 11);
  const Calibration calibration = calibrate(robot, run.log);
  Log log = run.log;
  const Eigen::Index jump = log.sample_count() / 2;
  log.roll_pitch_yaw_rad.col(2).tail(log.sample_count() - jump).array() += 6.0 * kDegree;
  EXPECT_LE(silently_wrong_s(track(calibration, log).samples, run.truth), 0.3);
}

TEST(Tracker, RestsWhereTheCalibrationAllowsForEffects) {
  const StartUpRun run = simulated(load_robot("irma4"), 100.0, 3, {});
  Robot robot = load_robot("irma4");
  robot.platform.mass_kg *= 0.95;
  finalise(robot);
  const Calibration calibration = calibrate(robot, run.log);
  EXPECT_THAT(calibration.result.reason, testing::HasSubstr("allow for every known effect"));
  const Matrix6& covariance = *calibration.result.covariance;
  EXPECT_LT((covariance - covariance.transpose()).cwiseAbs().maxCoeff(),
            1e-9 * covariance.diagonal().maxCoeff());
  const Track found = track(calibration, run.log);
  for (std::size_t i = 0; i < 200; ++i) {
    const TrackedSample& now = found.samples[i];
    ASSERT_TRUE(now.trusted) << now.reason;
    EXPECT_GT(SymmetricEigen<Matrix6>(now.pose_covariance).eigenvalues()[0], 0.0);
    EXPECT_LT(error_of(now, run.truth[i]).head<3>().norm(), 0.02);
  }
}

TEST(Tracker, FindsWhichSensorIsLate) {
  struct Late {
    std::vector<SensorChannel SensorOptions::*> channels;
    double delay_s;
    const char* words;
  };
  const Late all[] = {
      {{&SensorOptions::roll_pitch_rad}, 0.1, "the attitude come (9[0-9]|10[0-9])[.0-9]* ms later"},
      {{&SensorOptions::length_m}, 0.03, "the cable length come (29|3[01])[.0-9]* ms later"},
      {{&SensorOptions::length_m, &SensorOptions::swivel_rad},
       0.05,
       "the attitude come (4[4-9]|5[0-6])[.0-9]* ms earlier"},
  };
  const Robot robot = load_robot("irma4");
  StartUpPlan plan;
  plan.setpoint_N = default_setpoints(robot, 2, 2, 2);
  for (const Late& late : all) {
    SCOPED_TRACE(late.words);
    StartUpRunOptions options;
    options.log_rate_Hz = 100.0;
    options.simulator.seed = 1;
    for (const auto channel : late.channels) {
      (options.simulator.sensors.*channel).delay_s = late.delay_s;
    }
    const StartUpRun run = simulate_startup(robot, plan, options);
    const Calibration calibration = calibrate(robot, run.log);
    const Track found = track(calibration, run.log);
    EXPECT_LE(silently_wrong_s(found.samples, run.truth), 0.1);
    const auto told = [&](const TrackedSample& now) {
      return !now.trusted && testing::Value(now.reason, testing::ContainsRegex(late.words));
    };
    EXPECT_GT(std::ranges::count_if(found.samples, told), 500);
    // While it runs it is told once it moved for long enough.
    const std::vector<TrackedSample> live = streamed(calibration, run.log);
    EXPECT_LE(silently_wrong_s({live.begin() + 5000, live.end()},
                               {run.truth.begin() + 5000, run.truth.end()}),
              0.1);
  }
}

TEST(Tracker, ReadsNothingOffASlackCable) {
  const Robot robot = load_robot("irma4");
  StartUpRun run = simulated(robot, 100.0, 7);
  const Calibration calibration = calibrate(robot, run.log);
  const Track taut = track(calibration, run.log);
  const Eigen::Index row = run.log.sample_count() / 2;
  run.log.tension_N.col(2).segment(row, 100).setZero();
  run.log.length_m.col(2).segment(row, 100).array() += 0.5;
  run.log.swivel_rad.col(2).segment(row, 100).array() -= 0.4;
  const Track slack = track(calibration, run.log);
  for (std::size_t i = 0; i < slack.samples.size(); ++i) {
    EXPECT_TRUE(slack.samples[i].trusted);
    EXPECT_EQ(slack.samples[i].left_out, taut.samples[i].left_out);
    const Vector6 sigma = slack.samples[i].pose_covariance.diagonal().cwiseSqrt();
    const Vector6 error = error_of(slack.samples[i], run.truth[i]);
    EXPECT_LT(error.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 6.0);
  }
  const auto during = static_cast<std::size_t>(row) + 50;
  EXPECT_GT(slack.samples[during].pose_covariance.trace(),
            taut.samples[during].pose_covariance.trace());
}

TEST(Tracker, StartsAnewAfterAGap) {
  const Robot robot = load_robot("irma4");
  StartUpRun run = simulated(robot, 100.0, 8);
  const Calibration calibration = calibrate(robot, run.log);
  const Eigen::Index row = run.log.sample_count() / 2;
  const auto at = static_cast<std::size_t>(row);
  const auto speed_variance = [](const TrackedSample& s) {
    return s.twist_covariance.topLeftCorner<3, 3>().trace();
  };
  for (const double gap_s : {1.9, 2.1}) {
    SCOPED_TRACE(gap_s);
    Log log = run.log;
    log.time_s.tail(log.sample_count() - row).array() += gap_s;
    const std::vector<TrackedSample> all = streamed(calibration, log);
    // After a start from nothing the speed is anybody's guess.
    if (gap_s > 2.0) {
      EXPECT_NEAR(speed_variance(all[at]), 3.0, 0.01);
    }
    EXPECT_TRUE(all.back().trusted) << all.back().reason;
    EXPECT_LE(silently_wrong_s(all, run.truth), 0.1);
  }
}

TEST(Tracker, FindsBackAfterSensorsWereSilent) {
  const Robot robot = load_robot("irma4");
  const StartUpRun run = simulated(robot, 100.0, 1);
  const Calibration calibration = calibrate(robot, run.log);
  // A bus that is down: samples go on, without readings.
  for (const Eigen::Index silent : {50, 395}) {
    SCOPED_TRACE(silent);
    Log log = run.log;
    const Eigen::Index row = 5;
    for (LogMatrix* m : {&log.length_m, &log.swivel_rad, &log.tension_N, &log.roll_pitch_yaw_rad}) {
      m->middleRows(row, silent).setConstant(kNaN);
    }
    const Track found = track(calibration, log);
    EXPECT_FALSE(found.samples[static_cast<std::size_t>(row + silent - 1)].trusted);
    const TrackedSample& later = found.samples[static_cast<std::size_t>(row + silent + 200)];
    EXPECT_TRUE(later.trusted) << later.reason;
    EXPECT_LE(silently_wrong_s(found.samples, run.truth), 0.1);
  }
}

TEST(Tracker, StreamsWhatTrackDoesAtOnce) {
  const Robot robot = load_robot("irma4");
  const StartUpRun run = simulated(robot, 100.0, 9);
  const Calibration calibration = calibrate(robot, run.log);
  const Track whole = track(calibration, run.log);
  const std::vector<TrackedSample> one_by_one = streamed(calibration, run.log);
  for (std::size_t i = 0; i < one_by_one.size(); ++i) {
    EXPECT_EQ(one_by_one[i].state.pose.position_m, whole.samples[i].state.pose.position_m);
    EXPECT_EQ(one_by_one[i].pose_covariance, whole.samples[i].pose_covariance);
  }
  EXPECT_EQ(whole.convention, robot.euler_convention);
}

TEST(Tracker, StaysInThePlaneOfAGuidedPlatform) {
  const Robot robot = load_robot("belts4");
  const std::vector<SyntheticStop> stops = default_stops(robot, 2, 1, 2);
  std::vector<CableVector> setpoints_N;
  std::vector<Pose> poses;
  for (const SyntheticStop& stop : stops) {
    setpoints_N.push_back(stop.tension_N);
    poses.push_back(stop.pose);
  }
  double rows = 0.0, within = 0.0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SyntheticLogOptions options;
    options.noise = reading_noise(robot.sigma, 0.1);
    options.seed = seed;
    options.rate_Hz = 50.0;
    const SyntheticLog made = synthetic_log(robot, setpoints_N, options, poses);
    const Calibration calibration = calibrate(robot, made.log);
    const Track found = track(calibration, made.log);
    for (std::size_t i = 0; i < found.samples.size(); ++i) {
      const TrackedSample& now = found.samples[i];
      ASSERT_TRUE(now.trusted) << now.reason;
      EXPECT_EQ(now.state.pose.position_m.y(), made.poses[i].position_m.y());
      EXPECT_LT(log_so3(now.state.pose.rotation).norm(), 1e-12);
      EXPECT_EQ(now.state.twist[1], 0.0);
      EXPECT_LT(now.pose_covariance(1, 1), 1e-20);
      EXPECT_LT(now.pose_covariance.diagonal().tail<3>().maxCoeff(), 1e-20);
      for (const int axis : {0, 2}) {
        const double off = now.state.pose.position_m[axis] - made.poses[i].position_m[axis];
        rows += 1.0;
        within += std::abs(off) < 1.96 * std::sqrt(now.pose_covariance(axis, axis)) ? 1.0 : 0.0;
      }
    }
  }
  EXPECT_GT(within / rows, 0.88);
}

TEST(Tracker, RefusesWhatCannotBeTracked) {
  const Robot robot = load_robot("irma4");
  const StartUpRun run = simulated(robot, 10.0, 10);
  const Calibration good = calibrate(robot, run.log);
  const auto sample = [&](Eigen::Index row) {
    return measurement_at(run.log, row, PoseKind::kinematic_pose, 4);
  };
  Tracker tracker(good);
  EXPECT_TRUE(std::isnan(tracker.latest().time_s));
  tracker.add(sample(3));
  const std::string late = refusal_of([&] { tracker.add(sample(3)); });
  EXPECT_THAT(late, testing::HasSubstr("give them in order, each once"));
  EXPECT_EQ(refusal_of([&] { tracker.add(sample(2)); }).substr(0, 17), late.substr(0, 17));
  Measurement five = sample(4);
  five.length_m = CableVector::Zero(5);
  EXPECT_THAT(refusal_of([&] { tracker.add(five); }),
              testing::HasSubstr("reads 5 cables, robot 'irma4' has 4"));
  tracker.add(sample(4));  // what was refused has changed nothing
  EXPECT_EQ(tracker.latest().time_s, run.log.time_s[4]);

  Log of_five = run.log;
  of_five.length_m.resize(run.log.sample_count(), 5);
  EXPECT_THAT(refusal_of([&] { track(good, of_five); }), testing::HasSubstr("has 5 cables"));
  EXPECT_THAT(refusal_of([&] { track(good, run.log, 4); }), testing::HasSubstr("segment 4"));

  CalibrateOptions few;
  few.method = Method::kinematic;
  few.at_s = {1.0, 10.0};
  Log poor = run.log;
  poor.swivel_rad.resize(poor.sample_count(), 0);
  poor.tension_N.resize(poor.sample_count(), 0);
  const Calibration open = calibrate(robot, poor, few);
  EXPECT_NE(open.result.status, CalibrationStatus::converged);
  EXPECT_THAT(refusal_of([&] { Tracker{open}; }),
              testing::HasSubstr("the calibration has no pose that can be trusted"));
}

}  // namespace
}  // namespace cdprcal::test
