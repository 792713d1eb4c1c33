#include "cdprcal/diagnosis/events.hpp"

#include <gtest/gtest.h>

#include "run.hpp"

namespace cdprcal {
namespace {

using test::startup_log;

std::vector<LogEvent> named(const std::vector<LogEvent>& events, const std::string& name) {
  std::vector<LogEvent> out;
  for (const LogEvent& event : events) {
    if (event.name == name) out.push_back(event);
  }
  return out;
}

class Events : public ::testing::Test {
 protected:
  const Robot robot = load_robot("irma4");
  Log log = startup_log(robot, 0.2, 5, 0);
  /// A sample in the middle of the first move.
  static constexpr Eigen::Index kRow = 60;
};

TEST_F(Events, ACleanLogHasNone) { EXPECT_TRUE(gate_events(robot, log).empty()); }

TEST_F(Events, OneReadingAtZeroIsSlackWhenThePlatformJerks) {
  log.tension_N(kRow, 2) = 0.7;
  log.roll_pitch_yaw_rad(kRow, 0) += 0.08;
  log.roll_pitch_yaw_rad(kRow + 1, 0) -= 0.08;
  const auto slack = named(gate_events(robot, log), "slack");
  ASSERT_EQ(slack.size(), 1U);
  EXPECT_EQ(slack[0].cable, 2);
  EXPECT_NEAR(slack[0].begin_s, log.time_s[kRow], 1e-9);
  EXPECT_NE(describe(slack[0]).find("slack at 6.00 s"), std::string::npos) << describe(slack[0]);
  EXPECT_TRUE(std::isnan(log.tension_N(kRow, 2)));
}

TEST_F(Events, ADropOutOfOneReadingIsAnOutlier) {
  log.tension_N(kRow, 2) = 0.0;
  const auto events = gate_events(robot, log);
  EXPECT_TRUE(named(events, "slack").empty());
  ASSERT_EQ(named(events, "outlier").size(), 1U);
  EXPECT_EQ(named(events, "outlier")[0].channel, "tension");
}

TEST_F(Events, ASwingBetweenTwoRestsOfOneSetPointIsAnOscillation) {
  // The first dwell, 4 s at 10 Hz, made 20 s long with 4 s of swing in its middle.
  constexpr Eigen::Index kMore = 160;
  Log longer = log;
  const Eigen::Index rows = log.sample_count() + kMore;
  longer.time_s = Eigen::VectorXd::LinSpaced(rows, 0.0, 0.1 * static_cast<double>(rows - 1));
  RandomNormal random(7);
  const auto stretch = [&](const LogMatrix& from, LogMatrix& to, double noise) {
    to.resize(rows, from.cols());
    for (Eigen::Index i = 0; i < kMore; ++i) {
      for (Eigen::Index c = 0; c < from.cols(); ++c) {
        to(i, c) = from.col(c).head(40).mean() + noise * random();
      }
    }
    to.bottomRows(from.rows()) = from;
  };
  stretch(log.length_m, longer.length_m, 0.2 * robot.sigma.length_m);
  stretch(log.swivel_rad, longer.swivel_rad, 0.2 * robot.sigma.swivel_rad);
  stretch(log.tension_N, longer.tension_N, 0.2 * robot.sigma.tension_N);
  stretch(log.roll_pitch_yaw_rad, longer.roll_pitch_yaw_rad, 0.2 * robot.sigma.attitude_rad);
  stretch(log.tension_setpoint_N, longer.tension_setpoint_N, 0.0);
  longer.tension_setpoint_N.topRows(kMore).rowwise() = longer.tension_setpoint_N.row(kMore);
  for (Eigen::Index i = 60; i < 100; ++i) {
    longer.length_m.row(i).array() += 0.03 * std::sin(0.4 * static_cast<double>(i - 60));
  }
  const auto swings = named(gate_events(robot, longer), "oscillation");
  ASSERT_FALSE(swings.empty());
  EXPECT_NEAR(swings[0].begin_s, 6.0, 1.1);
  EXPECT_NEAR(swings[0].end_s, 10.0, 1.1);
}

}  // namespace
}  // namespace cdprcal
