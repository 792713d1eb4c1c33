// How long the platform stayed where it was at the first sample.
#include "cdprcal/readings/still.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal::test {
namespace {

constexpr Eigen::Index kSamples = 80;
constexpr double kNoise_m = 2e-3;

/// Three lengths that all do `motion` of the share of the time that is over, under white noise.
Log moving(const std::function<double(double)>& motion, RandomNormal& random) {
  Log log;
  log.source = "run.csv";
  log.time_s = Eigen::VectorXd::LinSpaced(kSamples, 0.0, 0.1 * (kSamples - 1));
  log.length_m.resize(kSamples, 3);
  for (Eigen::Index i = 0; i < kSamples; ++i) {
    const double at = motion(static_cast<double>(i) / kSamples);
    for (double& length_m : log.length_m.row(i)) length_m = 2.0 + at + kNoise_m * random();
  }
  return log;
}

/// What the mean of the part that was found is off from the first sample's place, in standard
/// deviations of a mean of independent readings; the worst of several runs.
double worst_bias(const std::function<double(double)>& motion) {
  RandomNormal random(7);
  double worst = 0.0;
  for (int run = 0; run < 20; ++run) {
    const Log log = moving(motion, random);
    const SampleRange found = still_since_start(log, {0, kSamples});
    EXPECT_EQ(found.begin, 0);
    double place = 0.0;
    for (Eigen::Index i = 0; i < found.end; ++i) place += motion(static_cast<double>(i) / kSamples);
    const auto count = static_cast<double>(found.size());
    worst = std::max(worst, std::abs(place / count - motion(0.0)) / kNoise_m * std::sqrt(count));
  }
  return worst;
}

TEST(Still, AllOfARestWhereNothingMoves) {
  RandomNormal random(3);
  Eigen::Index kept = 0;
  for (int run = 0; run < 50; ++run) {
    kept += still_since_start(moving([](double) { return 0.0; }, random), {0, kSamples}).size();
  }
  EXPECT_GT(kept, 50 * kSamples * 95 / 100);
}

TEST(Still, NotWhatDriftsAway) {
  EXPECT_LT(worst_bias([](double t) { return 4.0 * kNoise_m * t; }), 4.0);
}

TEST(Still, NotWhatGoesAndComesBackBelowTheNoise) {
  // Its halves have the same mean.
  EXPECT_LT(worst_bias([](double t) { return 2.0 * kNoise_m * std::sin(kPi * t); }), 4.0);
}

TEST(Still, NeverLessThanTheLeast) {
  RandomNormal random(5);
  const Log log = moving([](double t) { return 1e3 * kNoise_m * t; }, random);
  EXPECT_EQ(still_since_start(log, {0, kSamples}, {}, 6).size(), 6);
}

}  // namespace
}  // namespace cdprcal::test
