// How much a reading may be wrong: what a robot file says, what a log shows.
#include "cdprcal/readings/noise.hpp"

#include <gtest/gtest.h>

#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal::test {
namespace {

TEST(Channels, HaveTheNamesOfTheResult) {
  const std::vector<std::string> names{
      "length",         "swivel",          "roll_pitch",    "yaw",
      "balance",        "absolute_yaw",    "direct_length", "position",
      "specific_force", "angular_velocity"};
  ASSERT_EQ(names.size(), static_cast<std::size_t>(kChannels));
  for (std::size_t c = 0; c < names.size(); ++c) {
    EXPECT_EQ(to_string(static_cast<Channel>(c)), names[c]);
  }
}

TEST(ChannelNoise, OfAMeanHasAPartThatAveragesAndOneThatDoesNot) {
  const ChannelNoise noise{.pose = 3.0, .sample = {.sigma = 4.0}};
  EXPECT_DOUBLE_EQ(noise.sigma(1), 5.0);
  EXPECT_DOUBLE_EQ(noise.sigma(16), std::sqrt(10.0));
}

/// Four cables at 100 Hz, every channel moving smoothly with white noise of its own on it.
struct NoisyLog {
  Log log;
  std::array<double, kChannels> sigma{2e-4, 1e-3, 3e-3, 7e-3, 0.4, 5e-3, 1e-3, 2e-3, 4e-2, 3e-3};

  explicit NoisyLog(Eigen::Index rows) {
    RandomNormal random(8);
    log.source = "made up";
    log.time_s = Eigen::VectorXd::LinSpaced(rows, 0.0, 0.01 * static_cast<double>(rows - 1));
    const auto fill = [&](LogMatrix& m, Eigen::Index columns, std::size_t channel) {
      m.resize(rows, columns);
      for (Eigen::Index r = 0; r < rows; ++r) {
        for (Eigen::Index c = 0; c < columns; ++c) {
          m(r, c) =
              std::sin(0.5 * log.time_s[r] + static_cast<double>(c)) + sigma[channel] * random();
        }
      }
    };
    fill(log.length_m, 4, 0);
    fill(log.swivel_rad, 4, 1);
    fill(log.roll_pitch_yaw_rad, 3, 2);
    LogMatrix yaw;
    fill(yaw, 1, 3);
    log.roll_pitch_yaw_rad.col(2) = yaw;
    fill(log.tension_N, 4, 4);
    fill(log.absolute_yaw_rad, 1, 5);
    fill(log.direct_length_m, 4, 6);
    fill(log.position_m, 3, 7);
    fill(log.specific_force_m_s2, 3, 8);
    fill(log.angular_velocity_rad_s, 3, 9);
  }
};

TEST(SampleNoise, IsTheRippleOfEachChannelWhateverTheMotion) {
  const Robot robot = load_robot("irma4");
  NoisyLog made(6000);
  // Angles may jump by whole turns: that is no noise.
  for (Eigen::Index r = 0; r < made.log.sample_count(); ++r) {
    made.log.swivel_rad(r, 1) = wrap_angle(made.log.swivel_rad(r, 1) + kPi);
    made.log.absolute_yaw_rad(r, 0) = wrap_angle(made.log.absolute_yaw_rad(r, 0) + 3.0);
  }
  // One sensor of four that rattles is not all of them.
  for (Eigen::Index r = 0; r < made.log.sample_count(); r += 2) made.log.tension_N(r, 2) += 20.0;
  const auto noise = signals(made.log, {0, 6000}, {}, robot.sigma);
  for (std::size_t c = 0; c < kChannels; ++c) {
    EXPECT_NEAR(noise[c].sigma / made.sigma[c], 1.0, 0.06) << to_string(static_cast<Channel>(c));
  }
  // Of the run alone: what was before it does not count.
  made.log.length_m.topRows(3000).setRandom();
  EXPECT_NEAR(signals(made.log, {3000, 6000}, {}, robot.sigma)[0].sigma / made.sigma[0], 1.0, 0.08);
}

TEST(SampleNoise, OfWhatWasNotReadIsWhatTheRobotFileSays) {
  Robot robot = load_robot("irma4");
  robot.sigma.absolute_yaw_rad = 0.011;
  robot.sigma.direct_length_m = 0.012;
  robot.sigma.position_m = 0.013;
  NoisyLog made(50);
  Log& log = made.log;
  log.swivel_rad.resize(50, 0);
  log.tension_N.resize(50, 0);
  for_each_absolute([](const Sensor&, LogMatrix& m) { m.resize(50, 0); }, log);
  log.length_m.bottomRows(48).setConstant(kNaN);  // two readings show no noise
  log.roll_pitch_yaw_rad.col(2).setConstant(kNaN);
  const auto noise = signals(log, {0, 50}, {}, robot.sigma);
  const NoiseModel specified = specified_noise(robot.sigma);
  for (std::size_t c = 0; c < kChannels; ++c) {
    if (static_cast<Channel>(c) == Channel::roll_pitch) {
      EXPECT_NEAR(noise[c].sigma / made.sigma[c], 1.0, 0.4);
    } else {
      EXPECT_EQ(noise[c].sigma, specified.channel[c].sigma(1))
          << to_string(static_cast<Channel>(c));
    }
  }
  EXPECT_EQ(noise[0].sigma, robot.sigma.length_m);
  EXPECT_EQ(noise[3].sigma, robot.sigma.attitude_rad);
  EXPECT_EQ(noise[5].sigma, 0.011);
  EXPECT_EQ(noise[6].sigma, 0.012);
  EXPECT_EQ(noise[7].sigma, 0.013);
  EXPECT_EQ(specified.wrench_force_N, robot.sigma.wrench_force_N);
}

}  // namespace
}  // namespace cdprcal::test
