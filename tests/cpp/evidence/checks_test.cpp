// Whether a log has anything to check a model by.
#include "cdprcal/evidence/checks.hpp"

#include <gtest/gtest.h>

#include "../support/run.hpp"
#include "cdprcal/diagnosis/diagnose.hpp"

namespace cdprcal {
namespace {

/// The first rests of a run.
Log first_rests(const Log& log, const Diagnosis& whole, std::size_t rests) {
  return test::cut(log, 0, whole.baseline.runs[0].rows[rests].begin);
}

TEST(Checks, OneRestIsTooLittleToSay) {
  const Robot robot = load_robot("irma4");
  for (const std::uint64_t seed : {431, 432, 433}) {
    Log log = test::startup_log(robot, 0.2, seed, 0);
    const Diagnosis whole = diagnose(robot, {log});
    EXPECT_EQ(whole.verdict, Verdict::consistent) << test::summary(whole);
    const Diagnosis one = diagnose(robot, {first_rests(log, whole, 1)});
    EXPECT_EQ(one.verdict, Verdict::undetermined) << test::summary(one);
    EXPECT_TRUE(one.effects.empty());
    EXPECT_NE(one.reason.find("9 constants of the sensors"), std::string::npos) << one.reason;
    // What nothing could show counts in full.
    const auto variance = [](const Diagnosis& d) {
      return d.covariance_after.diagonal().head(3).sum();
    };
    EXPECT_GT(variance(one), 10.0 * variance(whole));
    const Diagnosis three = diagnose(robot, {first_rests(log, whole, 3)});
    EXPECT_NE(three.verdict, Verdict::undetermined) << test::summary(three);
  }
}

TEST(Checks, ReadingsAndConstantsAreCounted) {
  const Robot robot = load_robot("irma4");
  const Diagnosis d = diagnose(robot, {test::startup_log(robot, 0.2, 434, 0)});
  const Checks checks = checks_of(d.baseline);
  EXPECT_EQ(checks.constants, 9);  // of four lengths, four swivels and yaw
  const int rests = d.baseline.pose_count();
  EXPECT_NEAR(checks.readings, rests * (17 - 6) - 9, 0.5);
}

TEST(Checks, ARestAtTheSamePlaceReadsTheSameOnceMore) {
  const Robot robot = load_robot("irma4");
  const Diagnosis d = diagnose(robot, {test::startup_log(robot, 0.2, 434, 0)});
  DiagnosisModel model = d.baseline;
  DiagnosisRun& run = model.runs[0];
  run.measurements.resize(2);
  run.poses.resize(2);
  EXPECT_TRUE(checks_of(model).enough());
  run.measurements[1] = run.measurements[0];
  run.measurements[1].time_s += 10.0;
  run.poses[1] = run.poses[0];
  EXPECT_FALSE(checks_of(model).enough());
  run.poses[1].position_m.x() += 0.05;  // of a frame of 3 m
  EXPECT_TRUE(checks_of(model).enough());
}

TEST(Checks, SamplesThatShareErrorsAreNoneOfTheirOwn) {
  // A robot whose log never rests: nothing but samples, in one log with white noise, in the other
  // with a length that goes wrong and right again over many of them.
  const Robot robot = load_robot("irma4");
  const auto checks = [&](double wave_m) {
    Log log = test::startup_log(robot, 0.2, 436, 0);
    log.tension_N.resize(log.sample_count(), 0);
    for (Eigen::Index i = 0; i < log.sample_count(); ++i) {
      log.length_m(i, 1) += wave_m * std::sin(0.2 * log.time_s[i]);
    }
    CalibrateOptions options;
    options.method = Method::kinematic;
    options.noise = NoiseSource::specified;  // all of them
    const Calibration calibration = calibrate(robot, log, options);
    DiagnosisModel model;
    model.robot = robot;
    DiagnosisRun run;
    run.measurements = calibration.problem.measurements;
    run.poses = calibration.result.poses;
    run.offsets = offsets_at(robot, run.poses[0], run.measurements[0]);
    model.runs.push_back(run);
    start_noise(model, calibration.signals);
    EXPECT_TRUE(fit_with_noise(model));
    return checks_of(model);
  };
  EXPECT_TRUE(checks(0.0).enough());
  const Checks shared = checks(0.05);
  EXPECT_GT(shared.shared, 0.4);
  EXPECT_GT(shared.readings, shared.constants);
  EXPECT_FALSE(shared.enough());
  EXPECT_NE(too_little(shared).find("share their errors"), std::string::npos);
}

TEST(Checks, NoiseFromFewResidualsIsUncertain) {
  const Robot robot = load_robot("irma4");
  const Diagnosis d = diagnose(robot, {test::startup_log(robot, 0.2, 435, 0)});
  const ChannelSums sums = channel_sums(d.baseline);
  const DiagnosisModel wide = with_uncertain_noise(d.baseline);
  for (std::size_t c = 0; c < kRestGroups; ++c) {
    if (sums.freedom[c] < 1.0) continue;
    const double factor = wide.noise[c] / d.baseline.noise[c];
    if (d.baseline.noise[c] > d.baseline.floor[c]) {
      const double freedom = std::max(3.0, sums.freedom[c]);
      EXPECT_NEAR(factor * factor, freedom / (freedom - 2.0), 1e-9);
    } else {
      EXPECT_EQ(factor, 1.0);  // the ripple says it, of thousands of samples
    }
  }
}

}  // namespace
}  // namespace cdprcal
