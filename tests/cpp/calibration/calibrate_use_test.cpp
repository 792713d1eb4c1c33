// What calibrate() is given: guesses, names, options; and what it refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/run.hpp"
#include "../support/scenario.hpp"
#include "cdprcal/calibration/calibrate.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class CalibrateUse : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    SyntheticLogOptions options;
    options.noise = reading_noise(load_robot("irma4").sigma, 0.05);
    options.seed = 12;
    run = new SyntheticLog(synthetic_log(load_robot("irma4"), irma4_setpoints(), options));
    run->log.source = "made.csv";
  }
  static void TearDownTestSuite() {
    delete run;
    run = nullptr;
  }
  const Robot robot = load_robot("irma4");
  static SyntheticLog* run;

  [[nodiscard]] static CalibrateOptions rests() {
    CalibrateOptions options;
    options.method = Method::statics;
    return options;
  }
};
SyntheticLog* CalibrateUse::run = nullptr;

TEST_F(CalibrateUse, FromAnyGoodGuessItIsTheSame) {
  const Calibration alone = calibrate(robot, run->log, rests());
  ASSERT_EQ(alone.result.status, CalibrationStatus::converged) << alone.result.reason;
  Vector6 off;
  off << 0.05, -0.04, 0.03, 0.04, -0.05, 0.06;
  CalibrateOptions initial = rests();
  initial.guess = {plus(run->poses.front(), off)};
  CalibrateOptions every = rests();
  for (const Pose& pose : alone.result.poses) every.guess.push_back(plus(pose, 0.2 * off));
  for (const CalibrateOptions& options : {initial, every}) {
    const Calibration guessed = calibrate(robot, run->log, options);
    ASSERT_EQ(guessed.result.status, CalibrationStatus::converged) << guessed.result.reason;
    EXPECT_LT(minus(guessed.result.poses[0], alone.result.poses[0]).norm(), 1e-6);
    EXPECT_NEAR(guessed.result.cost, alone.result.cost, 1e-4 * alone.result.cost);
  }
  CalibrateOptions two = rests();
  two.guess.assign(2, run->poses.front());
  EXPECT_THAT([&] { (void)calibrate(robot, run->log, two); },
              ThrowsMessage<InputError>(AllOf(HasSubstr("guess: 2 poses given for 9"),
                                              HasSubstr("or the initial pose alone"))));
}

TEST_F(CalibrateUse, ALogThatDoesNotServeIsRefusedWithWhatToDo) {
  const auto refusal = [&](const Log& log, const CalibrateOptions& options) -> std::string {
    try {
      (void)prepare(robot, log, options);
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  };
  Log empty;
  empty.source = "empty.csv";
  EXPECT_EQ(refusal(empty, {}), "empty.csv: the log has no samples; log again");
  EXPECT_EQ(refusal(Log{}, {}), "the log: the log has no samples; log again");
  CalibrateOptions none;
  none.most_starts = -1;
  EXPECT_EQ(refusal(run->log, none), "most_starts: is -1; give 1 or more");
  none = {};
  none.method = static_cast<Method>(99);
  EXPECT_THAT(refusal(run->log, none), HasSubstr("is not one of unified, static, kinematic"));
  for (const double spacing_s : {0.0, -1.0, kNaN}) {
    CalibrateOptions options;
    options.kinematic_spacing_s = spacing_s;
    EXPECT_EQ(refusal(run->log, options), "kinematic_spacing_s must be positive");
  }
  CalibrateOptions segment;
  segment.segment = 1;
  EXPECT_THAT(refusal(run->log, segment),
              HasSubstr("made.csv: segment 1 asked for, but the log has 1"));
  segment.segment = 0;
  EXPECT_EQ(refusal(run->log, segment), "");
  CalibrateOptions by_hand = rests();
  by_hand.at_s = {2.0, 12.0, 400.0};
  EXPECT_THAT(refusal(run->log, by_hand),
              AllOf(HasSubstr("made.csv: no sample at 400.000 s"), HasSubstr("from 0.000 s to")));
  by_hand.at_s = {2.0, 1e300};
  EXPECT_THAT(refusal(run->log, by_hand), HasSubstr("no sample at 1e+300 s; the run"));
  by_hand.at_s = {2.0, kNaN};
  EXPECT_THAT(refusal(run->log, by_hand), HasSubstr("no sample at nan"));
  by_hand.at_s = {2.0, 12.0, 2.02};
  EXPECT_THAT(refusal(run->log, by_hand),
              HasSubstr("at: 2.020 s names a sample that is named already"));
}

TEST_F(CalibrateUse, ALogThatBeginsInMotionAndContradictsItselfIsSaidTo) {
  // Nothing balances, and the reference is no rest: what it is sought by is not sought once more.
  Log log = cut(run->log, 70, run->log.sample_count() - 70);
  log.tension_N.resize(log.sample_count(), 0);
  log.tension_setpoint_N.resize(log.sample_count(), 0);
  log.length_m.col(0).swap(log.length_m.col(2));
  log.length_m.col(1) *= -1.0;
  const Calibration found = calibrate(robot, log);
  EXPECT_EQ(found.result.status, CalibrationStatus::not_converged);
  EXPECT_GE(found.static_poses, 4);
  EXPECT_EQ(found.problem.measurements.front().kind, PoseKind::kinematic_pose);
}

TEST_F(CalibrateUse, PosesByHandAreTheSamplesNearestToTheirTimes) {
  CalibrateOptions options = rests();
  options.at_s = {2.04, 11.97, 22.0};
  const Calibration by_hand = prepare(robot, run->log, options);
  ASSERT_EQ(by_hand.problem.measurements.size(), 3U);
  EXPECT_DOUBLE_EQ(by_hand.problem.measurements[0].time_s, 2.0);
  EXPECT_DOUBLE_EQ(by_hand.problem.measurements[1].time_s, 12.0);
  EXPECT_DOUBLE_EQ(by_hand.problem.measurements[2].time_s, 22.0);
  EXPECT_EQ(by_hand.static_poses, 3);
  EXPECT_TRUE(by_hand.equilibria.empty());
  options.method = Method::kinematic;
  EXPECT_EQ(prepare(robot, run->log, options).kinematic_poses, 3);
}

TEST_F(CalibrateUse, WhileASetPointChangesNothingIsAveraged) {
  // A dwell of 5 s; in its last second the set-point creeps by a hundredth of a newton, too little
  // for any sensor to show: those samples are no part of the rest's mean.
  Log log = run->log;
  ASSERT_EQ(log.tension_setpoint_N.cols(), 4);
  const Calibration plain = prepare(robot, log, rests());
  const auto in_second_rest = [&](Eigen::Index row) {
    return log.time_s[row] > 14.0 && log.time_s[row] <= 15.0;
  };
  for (Eigen::Index row = 0; row < log.sample_count(); ++row) {
    if (in_second_rest(row)) log.tension_setpoint_N(row, 2) += 0.01 * (log.time_s[row] - 14.0);
  }
  const Calibration creeping = prepare(robot, log, rests());
  ASSERT_EQ(creeping.problem.measurements.size(), plain.problem.measurements.size());
  EXPECT_LT(creeping.problem.measurements[1].samples, plain.problem.measurements[1].samples - 5);
  EXPECT_EQ(creeping.problem.measurements[2].samples, plain.problem.measurements[2].samples);
}

TEST_F(CalibrateUse, TheSourceOfTheNoiseFollowsTheFormulationUnlessItIsGiven) {
  CalibrateOptions options;
  EXPECT_EQ(noise_source(options), NoiseSource::from_data);
  options.formulation = Formulation::paper;
  EXPECT_EQ(noise_source(options), NoiseSource::specified);
  options.noise = NoiseSource::from_data;
  EXPECT_EQ(noise_source(options), NoiseSource::from_data);
  EXPECT_EQ(parse_noise_source("data"), NoiseSource::from_data);
  for (const NoiseSource source : {NoiseSource::from_data, NoiseSource::specified}) {
    EXPECT_EQ(parse_noise_source(to_string(source)), source);
  }
  EXPECT_THAT([] { (void)parse_noise_source("none"); },
              ThrowsMessage<InputError>("noise: 'none' is not one of data, specified"));
  EXPECT_THAT(
      [] { (void)parse_method("dynamic"); },
      ThrowsMessage<InputError>("method: 'dynamic' is not one of unified, static, kinematic"));
  EXPECT_THAT([] { (void)parse_formulation("short"); },
              ThrowsMessage<InputError>("formulation: 'short' is not one of full, paper"));
}

TEST_F(CalibrateUse, APoseThatAnotherFitsAsWellIsNotClaimed) {
  // Geometry alone, on a run of two stops: few readings, and for some pairs of stops two places fit
  // them. Where a pose is claimed it is the right one.
  const auto setpoints = irma4_setpoints();
  int claimed = 0, ambiguous = 0;
  for (const auto& [a, b] : std::vector<std::pair<int, int>>{
           {4, 5}, {2, 7}, {7, 6}, {1, 3}, {8, 5}, {1, 4}, {2, 6}, {0, 6}, {3, 7}, {7, 4}}) {
    SCOPED_TRACE(std::to_string(a) + " to " + std::to_string(b));
    SyntheticLogOptions made;
    made.noise = reading_noise(robot.sigma, 0.01);
    made.seed = static_cast<std::uint64_t>(10 * a + b);
    const SyntheticLog two = synthetic_log(robot, {setpoints[a], setpoints[b]}, made);
    CalibrateOptions options;
    options.method = Method::kinematic;
    const CalibrationResult result = calibrate(robot, two.log, options).result;
    if (result.status == CalibrationStatus::converged) {
      ++claimed;
      const Vector6 error = minus(result.poses[0], two.poses[0]);
      EXPECT_LT(error.dot(result.covariance->inverse() * error), 30.0) << "six of them; 4e-5";
      continue;
    }
    EXPECT_EQ(result.status, CalibrationStatus::unobservable) << result.reason;
    EXPECT_FALSE(result.covariance);
    EXPECT_TRUE(result.standard_deviation().array().isNaN().all());
    if (result.reason.starts_with("another initial pose fits the readings about as well, ")) {
      ++ambiguous;
    }
  }
  EXPECT_GE(claimed, 3);
  EXPECT_GE(ambiguous, 3);
}

TEST_F(CalibrateUse, WithTheSpecifiedNoiseEveryReadingIsKept) {
  Log log = run->log;
  log.length_m.row(25).array() += 0.2;  // an outlier, plain to see
  log.tension_N.row(26).setConstant(1.0);
  CalibrateOptions options;
  options.noise = NoiseSource::specified;
  const Calibration kept = calibrate(robot, log, options);
  EXPECT_TRUE(kept.gated.empty());
  EXPECT_FALSE(kept.problem.noise);
}

}  // namespace
}  // namespace cdprcal::test
