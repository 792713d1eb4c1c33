// How long the platform stayed where it was at the first sample.
#include "cdprcal/readings/still.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal::test {
namespace {

constexpr Eigen::Index kSamples = 80;
constexpr double kScatter_m = 2e-3;

/// Three lengths that all do `motion` of the share of the time that is over, under white noise.
Log moving(const std::function<double(double)>& motion, RandomNormal& random) {
  Log log;
  log.source = "run.csv";
  log.time_s = Eigen::VectorXd::LinSpaced(kSamples, 0.0, 0.1 * (kSamples - 1));
  log.length_m.resize(kSamples, 3);
  for (Eigen::Index i = 0; i < kSamples; ++i) {
    const double at = motion(static_cast<double>(i) / kSamples);
    for (double& length_m : log.length_m.row(i)) length_m = 2.0 + at + kScatter_m * random();
  }
  return log;
}

/// What the mean of the part that was found is off from the first sample's place, in standard
/// deviations of a mean of independent readings; the worst of several runs.
template <typename Find>
double worst_bias(const std::function<double(double)>& motion, const Find& find) {
  RandomNormal random(7);
  double worst = 0.0;
  for (int run = 0; run < 20; ++run) {
    const Log log = moving(motion, random);
    const SampleRange found = find(log);
    EXPECT_EQ(found.begin, 0);
    double place = 0.0;
    for (Eigen::Index i = 0; i < found.end; ++i) place += motion(static_cast<double>(i) / kSamples);
    const auto count = static_cast<double>(found.size());
    worst = std::max(worst, std::abs(place / count - motion(0.0)) / kScatter_m * std::sqrt(count));
  }
  return worst;
}

/// How many samples of fifty rests without a motion are found.
template <typename Find>
Eigen::Index kept_of_rests(std::uint64_t seed, const Find& find) {
  RandomNormal random(seed);
  Eigen::Index kept = 0;
  for (int run = 0; run < 50; ++run) {
    kept += find(moving([](double) { return 0.0; }, random)).size();
  }
  return kept;
}

SampleRange still(const Log& log) { return still_since_start(log, {0, kSamples}); }
SampleRange first(const Log& log) { return at_the_start(log, {0, kSamples}); }

TEST(Still, AllOfARestWhereNothingMoves) {
  EXPECT_GT(kept_of_rests(3, still), 50 * kSamples * 95 / 100);
}

TEST(Still, AllOfARestIsItsBeginning) {
  EXPECT_GT(kept_of_rests(11, first), 50 * kSamples * 85 / 100);
}

double drift(double t) { return 4.0 * kScatter_m * t; }
double there_and_back(double t) { return 2.0 * kScatter_m * std::sin(kPi * t); }
double late(double t) { return t < 0.3 ? 0.0 : 30.0 * kScatter_m * (t - 0.3) * (t - 0.3); }

TEST(Still, WhatDoesNotShowYetIsOffByFourSigma) {
  EXPECT_LT(worst_bias(drift, still), 5.0);
  EXPECT_LT(worst_bias(there_and_back, still), 5.0);  // its halves have the same mean
  EXPECT_LT(worst_bias(late, still), 5.0);
  // Which is more than a mean may be off by.
  EXPECT_GT(worst_bias(drift, still), 2.0);
}

TEST(Still, TheFirstHalfOfItIsWhereThePlatformWas) {
  EXPECT_LT(worst_bias(drift, first), 2.0);
  EXPECT_LT(worst_bias(there_and_back, first), 2.0);
  EXPECT_LT(worst_bias(late, first), 1.0);
}

TEST(Still, NothingWhereItMovesAtOnce) {
  RandomNormal random(5);
  const Log log = moving([](double t) { return 1e3 * kScatter_m * t; }, random);
  EXPECT_EQ(still_since_start(log, {0, kSamples}).size(), 1);
  EXPECT_EQ(at_the_start(log, {0, kSamples}).size(), 1);
  // Nor what comes to rest after a few samples: their mean is neither the one place nor the other.
  const Log late =
      moving([](double t) { return -10.0 * kScatter_m * std::exp(-40.0 * t); }, random);
  EXPECT_LT(at_the_start(late, {0, kSamples}).size(), kFewestStill);
}

TEST(Still, LengthsAreBehindNoLongerFilterThanTheOtherSensors) {
  RandomNormal random(17);
  const Log log =
      moving([](double t) { return t < 0.2 ? 0.0 : 2.0 * kScatter_m * std::sin(5.0 * t); }, random);
  Signals signals;
  Signal& length = signals[static_cast<std::size_t>(Channel::length)];
  length = {.sigma = 2.0 * kScatter_m, .rows = 12.0, .correlation_s = 0.6, .period_s = 0.1};
  Signal& swivel = signals[static_cast<std::size_t>(Channel::swivel)];
  swivel = length;
  EXPECT_EQ(still_since_start(log, {0, kSamples}, signals).size(), kSamples);
  swivel.correlation_s = 0.1;
  EXPECT_LT(still_since_start(log, {0, kSamples}, signals).size(), kSamples / 2);
  swivel.correlation_s = 0.0;  // nothing says how long theirs may be
  EXPECT_EQ(still_since_start(log, {0, kSamples}, signals).size(), kSamples);
}

TEST(Still, AReadingThatStandsOutAloneIsNoMotion) {
  RandomNormal random(13);
  Log log = moving([](double) { return 0.0; }, random);
  for (const Eigen::Index i : {2, 30, 55}) log.length_m(i, 1) += 30.0 * kScatter_m;
  EXPECT_GT(at_the_start(log, {0, kSamples}).size(), kSamples / 3);
}

TEST(Still, TailsOfTheNoiseAreNoMotion) {
  // Student's t with three degrees of freedom, whose fourth moment is infinite.
  RandomNormal random(19);
  Eigen::Index kept = 0;
  for (int run = 0; run < 50; ++run) {
    Log log = moving([](double) { return 0.0; }, random);
    for (double& length_m : log.length_m.reshaped()) {
      double squares = 0.0;
      for (int k = 0; k < 3; ++k) squares += std::pow(random(), 2);
      length_m = 2.0 + kScatter_m * random() / std::sqrt(squares / 3.0);
    }
    kept += still_since_start(log, {0, kSamples}).size();
  }
  EXPECT_GT(kept, 50 * kSamples * 9 / 10);
}

}  // namespace
}  // namespace cdprcal::test
