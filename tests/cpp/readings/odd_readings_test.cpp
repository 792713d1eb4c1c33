// Single readings that no motion makes.
#include "cdprcal/readings/odd_readings.hpp"

#include <gtest/gtest.h>

#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal::test {
namespace {

TEST(OddReadings, StandOutOnOneSideOfBothNeighbours) {
  EXPECT_TRUE(stands_out(1.0, 2.0, 1.1, 0.5));
  EXPECT_TRUE(stands_out(1.0, 0.2, 1.1, 0.5));
  EXPECT_FALSE(stands_out(1.0, 2.0, 3.0, 0.5));  // on its way
  EXPECT_FALSE(stands_out(1.0, 2.0, 1.6, 0.5));
  EXPECT_FALSE(stands_out(kNaN, 2.0, 1.0, 0.5));
}

TEST(OddReadings, OfARestAreTheFewThatNoNoiseExplains) {
  RandomNormal random(3);
  std::vector<double> readings;
  for (int i = 0; i < 200; ++i) readings.push_back(2.0 + 1e-3 * random());
  std::vector<double> kept = readings;
  leave_out_odd(kept);
  EXPECT_EQ(kept, readings);
  kept.insert(kept.begin() + 50, 2.05);
  kept.insert(kept.begin() + 90, 1.9);
  kept.insert(kept.begin() + 92, 2.02);
  leave_out_odd(kept);
  EXPECT_EQ(kept, readings);
  std::vector<double> few{1.0, 1.0, 9.0}, alike(20, 1.0);
  alike[7] = 9.0;
  leave_out_odd(few);
  leave_out_odd(alike);
  EXPECT_EQ(few.size(), 3U);
  EXPECT_EQ(alike.size(), 20U);
  // What creeps at first is a part of the rest.
  std::vector<double> creeping;
  for (int i = 0; i < 60; ++i) creeping.push_back(std::exp(-0.2 * i) + 1e-4 * random());
  const std::size_t whole = creeping.size();
  leave_out_odd(creeping);
  EXPECT_EQ(creeping.size(), whole);
}

TEST(OddReadings, OfAMotionAreThoseFasterThanGravity) {
  Log log;
  log.time_s = Eigen::VectorXd::LinSpaced(3, 0.0, 0.2);
  log.length_m.resize(3, 2);
  log.length_m << 1.0, 1.0, 1.3, 1.05, 1.02, 1.0;  // 0.28 m and 0.05 m out; g allows 0.098 m
  log.swivel_rad.resize(3, 2);
  log.swivel_rad << 3.1, 0.0, -3.1, 2.5, 3.1, 0.0;  // over the seam, and out
  log.tension_N.resize(3, 2);
  log.tension_N << 10.0, 10.0, 500.0, 10.0, 10.0, 10.0;
  Measurement m = measurement_at(log, 1, PoseKind::kinematic_pose, 2);
  leave_out_impossible(log, 1, 9.80665, 0.2, m);
  EXPECT_TRUE(std::isnan(m.length_m[0]));
  EXPECT_EQ(m.length_m[1], 1.05);
  EXPECT_NEAR(m.swivel_rad[0], -3.1, 1e-12);
  EXPECT_TRUE(std::isnan(m.swivel_rad[1]));
  EXPECT_EQ(m.tension_N[0], 500.0);
  Measurement first = measurement_at(log, 0, PoseKind::kinematic_pose, 2);
  leave_out_impossible(log, 0, 9.80665, 0.2, first);
  EXPECT_EQ(first.length_m[0], 1.0);
}

}  // namespace
}  // namespace cdprcal::test
