// A swing that gains energy while no winch turns.
#include "cdprcal/motion/pushes.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "cdprcal/motion/locked.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal::test {
namespace {

constexpr double kStep_s = 0.01;
constexpr int kSamples = 3000;

/// A platform that swings about a pose in its two free motions at once, as large as `size_at` says.
struct SwingingRun {
  explicit SwingingRun(const std::function<double(double)>& size_at) {
    const Robot& robot = calibration.problem.robot = load_robot("irma4");
    const Pose middle{{0.1, -0.05, 0.9}, Eigen::Quaterniond::Identity()};
    const Modes modes = modes_at(robot, middle);
    slowest_hz = modes.natural_frequency_hz[0];
    log.time_s = Eigen::VectorXd::LinSpaced(kSamples, 0.0, kStep_s * (kSamples - 1));
    log.length_m = LogMatrix::Zero(kSamples, robot.cable_count());
    for (int k = 0; k < kSamples; ++k) {
      const double time_s = log.time_s[k], size = size_at(time_s);
      SmoothedSample& sample = path.emplace_back();
      sample.time_s = time_s;
      sample.trusted = true;
      sample.covariance.setIdentity();
      sample.covariance *= 1e-8;
      Vector6 away = Vector6::Zero();
      for (Eigen::Index m = 0; m < modes.shape.cols(); ++m) {
        const double rate = 2.0 * kPi * modes.natural_frequency_hz[m];
        away += size / rate * std::sin(rate * time_s) * modes.shape.col(m);
        sample.state.twist += size * std::cos(rate * time_s) * modes.shape.col(m);
      }
      sample.state.pose = plus(middle, away);
    }
  }
  [[nodiscard]] std::vector<Push> found() const {
    return pushes(calibration, CorrectedRun(calibration.problem.robot, log), path);
  }

  Calibration calibration;
  Log log;
  std::vector<SmoothedSample> path;
  double slowest_hz = 0.0;
};

double decaying(double time_s) { return 0.5 * std::exp(-0.05 * time_s); }

/// Grows by half between 10 and 13 s.
double pushed(double time_s) {
  return decaying(time_s) * (1.0 + 0.5 * std::clamp((time_s - 10.0) / 3.0, 0.0, 1.0));
}

TEST(Pushes, AreWhereTheSwingGrows) {
  const SwingingRun run(&pushed);
  const std::vector<Push> found = run.found();
  ASSERT_EQ(found.size(), 1U) << in_words(found);
  const double blur_s = 2.0 / run.slowest_hz;
  EXPECT_NEAR(found[0].begin_s, 10.0, blur_s);
  EXPECT_NEAR(found[0].end_s, 13.0, blur_s);
  // Two modes of unit mass: their energy is ½ size² each.
  EXPECT_NEAR(found[0].before_J, std::pow(pushed(10.0), 2), 0.15 * found[0].before_J);
  EXPECT_NEAR(found[0].after_J, std::pow(pushed(13.0), 2), 0.15 * found[0].after_J);
  EXPECT_TRUE(is_pushed(found, 12.0));
  EXPECT_FALSE(is_pushed(found, 20.0));
  EXPECT_TRUE(is_pushed(found, found[0].end_s + 0.4, 0.5));
}

TEST(Pushes, ASwingThatOnlyDecaysHasNone) { EXPECT_TRUE(SwingingRun(&decaying).found().empty()); }

TEST(Pushes, AMomentOfNonsenseIsNone) {
  SwingingRun run(&decaying);
  for (std::size_t k = 1500; k < 1505; ++k) run.path[k].state.twist *= 100.0;
  EXPECT_TRUE(run.found().empty());
}

TEST(Pushes, ErrorsOfTheTwistsAreNone) {
  SwingingRun run([](double time_s) { return 1e-4 * pushed(time_s); });
  EXPECT_TRUE(run.found().empty());
}

TEST(Pushes, AWinchThatTurnsMayMoveThePlatform) {
  SwingingRun run(&pushed);
  for (int k = 900; k < 1500; ++k) run.log.length_m(k, 1) = 0.002 * (k - 900);
  for (int k = 1500; k < kSamples; ++k) run.log.length_m(k, 1) = 1.2;
  EXPECT_TRUE(run.found().empty());
}

TEST(Pushes, WhatRestsIsNotLookedAt) {
  SwingingRun run(&pushed);
  run.calibration.equilibria.push_back({.samples = {}, .begin_s = 9.0, .end_s = 14.0});
  EXPECT_TRUE(run.found().empty());
}

TEST(Pushes, ThatTouchAreOne) {
  std::vector<Push> known{{5.0, 6.0, 1.0, 2.0}, {10.0, 12.0, 0.0, 1.0}};
  add({{5.5, 9.0, 1.0, 4.0}, {20.0, 21.0, 0.0, 1.0}, {11.0, 11.5, 0.0, 0.5}}, known);
  ASSERT_EQ(known.size(), 3U);
  EXPECT_EQ(in_words(known), "5.0 to 9.0 s, 10.0 to 12.0 s and 20.0 to 21.0 s");
  EXPECT_EQ(known[0].after_J, 4.0);
  EXPECT_EQ(known[1].after_J, 1.0);
}

TEST(Pushes, AreSaidInOneSentence) {
  const Push one{5.12, 8.9, 0.0, 1.0}, two{11.0, 12.5, 0.0, 1.0}, three{20.0, 21.0, 0.0, 1.0};
  EXPECT_EQ(in_words(std::vector<Push>{one}), "5.1 to 8.9 s");
  EXPECT_EQ(in_words({one, two}), "5.1 to 8.9 s and 11.0 to 12.5 s");
  EXPECT_EQ(in_words({one, two, three}), "5.1 to 8.9 s, 11.0 to 12.5 s and 20.0 to 21.0 s");
}

}  // namespace
}  // namespace cdprcal::test
