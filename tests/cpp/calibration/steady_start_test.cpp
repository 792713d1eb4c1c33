#include "cdprcal/calibration/steady_start.hpp"

#include <gtest/gtest.h>

#include "cdprcal/acquisition/synthetic.hpp"
#include "cdprcal/model/robot_file.hpp"

namespace cdprcal {
namespace {

/// A rest of `count` samples at 10 Hz of a robot with a fifth of its σ as white noise; lengths 1 and
/// 2 are off by `away_m` over samples [begin, end).
Log resting(const Robot& robot, std::uint64_t seed, Eigen::Index count, double away_m,
            Eigen::Index begin, Eigen::Index end) {
  RandomNormal random(seed);
  Log log;
  log.time_s = Eigen::VectorXd::LinSpaced(count, 0.0, 0.1 * static_cast<double>(count - 1));
  const auto fill = [&](LogMatrix& m, Eigen::Index columns, double mean, double sigma) {
    m.resize(count, columns);
    for (Eigen::Index i = 0; i < count; ++i) {
      for (Eigen::Index c = 0; c < columns; ++c) m(i, c) = mean + 0.2 * sigma * random();
    }
  };
  fill(log.length_m, 4, 1.5, robot.sigma.length_m);
  fill(log.swivel_rad, 4, 0.2, robot.sigma.swivel_rad);
  fill(log.tension_N, 4, 100.0, robot.sigma.tension_N);
  fill(log.roll_pitch_yaw_rad, 3, 0.0, robot.sigma.attitude_rad);
  log.length_m.block(begin, 0, end - begin, 2).array() += away_m;
  return log;
}

Robot quiet_robot() {
  Robot robot = load_robot("irma4");
  robot.sigma.length_m *= 0.2;
  robot.sigma.swivel_rad *= 0.2;
  robot.sigma.attitude_rad *= 0.2;
  robot.sigma.tension_N *= 0.2;
  return robot;
}

TEST(SteadyStart, ARestStaysWhole) {
  const Robot robot = quiet_robot();
  const Robot noise = load_robot("irma4");
  int whole = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const Log log = resting(noise, seed, 80, 0.0, 0, 0);
    const SampleRange kept = steady_start(log, {0, 80}, {0, 80}, robot.sigma);
    EXPECT_EQ(kept.begin, 0);
    EXPECT_GE(kept.size(), 5);
    whole += kept.size() == 80;
  }
  EXPECT_GE(whole, 54);
}

TEST(SteadyStart, EndsWhereThePlatformGoesAwayEvenIfItComesBack) {
  // 3 mm for two seconds, where a sample's noise is 2 mm: no sample stands out.
  const Robot robot = quiet_robot();
  const Robot noise = load_robot("irma4");
  int before = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const Log log = resting(noise, seed, 80, 0.003, 30, 50);
    const SampleRange kept = steady_start(log, {0, 80}, {0, 80}, robot.sigma);
    before += kept.end <= 34;
  }
  EXPECT_GE(before, 27);
}

TEST(SteadyStart, WhatTheToleranceAllowsCutsNothing) {
  Robot robot = quiet_robot();
  robot.sigma.length_m = 0.1;  // 5 mm do not matter to such a sensor
  const Log log = resting(load_robot("irma4"), 3, 80, 0.0025, 30, 50);
  EXPECT_EQ(steady_start(log, {0, 80}, {0, 80}, robot.sigma).size(), 80);
}

}  // namespace
}  // namespace cdprcal
