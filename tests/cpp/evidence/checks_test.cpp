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
