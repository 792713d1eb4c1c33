#include "cdprcal/diagnosis/events.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "../support/dense.hpp"
#include "../support/run.hpp"
#include "cdprcal/readings/equilibrium_detection.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal {
namespace {

using test::named;
using test::startup_log;

/// The first dwell, 4 s at 10 Hz, made 20 s long.
Log with_long_rest(const Log& log, const SensorSigma& sigma) {
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
  stretch(log.length_m, longer.length_m, 0.2 * sigma.length_m);
  stretch(log.swivel_rad, longer.swivel_rad, 0.2 * sigma.swivel_rad);
  stretch(log.tension_N, longer.tension_N, 0.2 * sigma.tension_N);
  stretch(log.roll_pitch_yaw_rad, longer.roll_pitch_yaw_rad, 0.2 * sigma.attitude_rad);
  stretch(log.tension_setpoint_N, longer.tension_setpoint_N, 0.0);
  longer.tension_setpoint_N.topRows(kMore).rowwise() = longer.tension_setpoint_N.row(kMore);
  return longer;
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

TEST_F(Events, ZeroIsWhatALoadCellKnownToReadTooMuchReadsOfASlackCable) {
  Robot known = robot;
  known.effects.push_back({"load_cell_bias", "", {{"bias_N", {0, 0, 60, 0}}}});
  log.tension_N.col(2).array() += 60.0;
  EXPECT_TRUE(gate_events(known, log).empty());
  log.tension_N(kRow, 2) = 60.7;
  log.roll_pitch_yaw_rad(kRow, 0) += 0.08;
  log.roll_pitch_yaw_rad(kRow + 1, 0) -= 0.08;
  const auto slack = named(gate_events(known, log), "slack");
  ASSERT_EQ(slack.size(), 1U);
  EXPECT_NEAR(slack[0].size, 0.7, 1e-12);
}

TEST_F(Events, AJerkShowsInAnyOtherReading) {
  struct Jerk {
    LogMatrix Log::* group;
    int columns;
    double size;
  };
  const SensorSigma& s = robot.sigma;
  for (const Jerk& jerk :
       {Jerk{&Log::length_m, 4, 10.0 * s.length_m}, Jerk{&Log::swivel_rad, 4, 10.0 * s.swivel_rad},
        Jerk{&Log::roll_pitch_yaw_rad, 3, 10.0 * s.attitude_rad},
        Jerk{&Log::tension_N, 4, 10.0 * s.tension_N}}) {
    for (int c = 0; c < jerk.columns; ++c) {
      SCOPED_TRACE(std::to_string(jerk.columns) + " columns, " + std::to_string(c));
      Log one = log;
      const bool own = jerk.group == &Log::tension_N && c == 2;
      one.tension_N(kRow, 2) = 0.5;
      if (!own) {
        (one.*jerk.group)(kRow, c) += jerk.size;
        (one.*jerk.group)(kRow + 1, c) -= jerk.size;
      }
      EXPECT_EQ(named(gate_events(robot, one), "slack").size(), own ? 0U : 1U);
    }
  }
  // An angle that is written a whole turn further from there on has not moved.
  for (LogMatrix Log::* angles : {&Log::swivel_rad, &Log::roll_pitch_yaw_rad}) {
    Log one = log;
    one.tension_N(kRow, 2) = 0.5;
    (one.*angles).col(1).tail(log.sample_count() - kRow).array() += 2.0 * std::numbers::pi;
    EXPECT_TRUE(named(gate_events(robot, one), "slack").empty());
  }
}

TEST_F(Events, AJerkIsAboutTheTimeOfTheSlackAndBeyondNoise) {
  // At rest, where nothing but the step bends the readings. Of six samples from one before the
  // slack on, 4 + 4 + 4 + 3 channels are looked at, at a chance of a thousandth over all.
  constexpr Eigen::Index kAt = 20;
  const double noise = channel_noise(log.roll_pitch_yaw_rad.col(0), true);
  const double least = normal_quantile(1.0 - 0.5e-3 / 90.0) * std::sqrt(6.0) * noise;
  const auto slack = [&](Eigen::Index step_at, double size) {
    Log one = log;
    one.tension_N(kAt, 2) = 0.5;
    const double bend = one.roll_pitch_yaw_rad(step_at, 0) -
                        2.0 * one.roll_pitch_yaw_rad(step_at - 1, 0) +
                        one.roll_pitch_yaw_rad(step_at - 2, 0);
    one.roll_pitch_yaw_rad.col(0).tail(log.sample_count() - step_at).array() += size - bend;
    return !named(gate_events(robot, one), "slack").empty();
  };
  for (const double side : {1.0, -1.0}) {
    EXPECT_TRUE(slack(kAt, side * 1.02 * least));
    EXPECT_FALSE(slack(kAt, side * 0.8 * least));
    // A step bends the readings at two samples.
    for (const Eigen::Index from : {-2, -1, 1, 3, 4}) {
      EXPECT_TRUE(slack(kAt + from, side * 2.0 * least)) << from;
    }
    for (const Eigen::Index from : {-4, -3, 5, 6}) {
      EXPECT_FALSE(slack(kAt + from, side * 2.0 * least)) << from;
    }
  }
}

TEST_F(Events, ZeroIsWithinFourSigmaOfNoise) {
  for (const double sigmas : {-3.5, 3.5, -4.7, 4.7}) {
    Log one = log;
    one.roll_pitch_yaw_rad.col(0).tail(log.sample_count() - kRow).array() += 0.2;
    one.tension_N(kRow, 2) = sigmas * channel_noise(log.tension_N.col(2));
    EXPECT_EQ(named(gate_events(robot, one), "slack").size(), std::abs(sigmas) < 4.0 ? 1U : 0U)
        << sigmas;
  }
}

TEST_F(Events, SlackAtTheLastSamplesThatAreJudged) {
  const Eigen::Index last = log.sample_count() - 4;
  for (const Eigen::Index row : {Eigen::Index{3}, last}) {
    Log one = log;
    one.tension_N(row, 2) = 0.5;
    one.roll_pitch_yaw_rad.col(0).tail(log.sample_count() - row).array() += 0.2;
    EXPECT_EQ(named(gate_events(robot, one), "slack").size(), 1U) << row;
  }
}

TEST_F(Events, AReadingIsJudgedByTheScatterOnBothSides) {
  // A sensor that dips now and again: one more departure of that size, to the other side, is
  // nothing out of the ordinary, whether the dips come before it or after it.
  for (const bool before : {true, false}) {
    Log dips = log;
    for (const Eigen::Index k : {4, 7, 10}) dips.length_m(before ? 20 - k : 20 + k, 1) -= 0.1;
    dips.length_m(20, 1) += 0.1;
    for (const LogEvent& event : gate_events(robot, dips)) {
      EXPECT_NE(event.begin_s, log.time_s[20]) << before << " " << describe(event);
    }
    Log alone = log;
    alone.length_m(20, 1) += 0.1;
    EXPECT_EQ(named(gate_events(robot, alone), "outlier").size(), 1U);
  }
}

TEST_F(Events, AnOutlierFarAwayHidesNone) {
  log.length_m(20, 1) += 1.0;
  log.length_m(70, 1) += 0.1;
  log.length_m(120, 1) += 1.0;
  const auto outliers = named(gate_events(robot, log), "outlier");
  ASSERT_EQ(outliers.size(), 3U);
  EXPECT_EQ(outliers[1].begin_s, log.time_s[70]);
}

TEST_F(Events, ADropOutOfOneReadingIsAnOutlier) {
  log.tension_N(kRow, 2) = 0.0;
  const auto events = gate_events(robot, log);
  EXPECT_TRUE(named(events, "slack").empty());
  ASSERT_EQ(named(events, "outlier").size(), 1U);
  EXPECT_EQ(named(events, "outlier")[0].channel, "tension");
}

TEST_F(Events, ASwingBetweenTwoRestsOfOneSetPointIsAnOscillation) {
  Log longer = with_long_rest(log, robot.sigma);  // with 4 s of swing in its middle
  for (Eigen::Index i = 60; i < 100; ++i) {
    longer.length_m.row(i).array() += 0.03 * std::sin(0.4 * static_cast<double>(i - 60));
  }
  const auto swings = named(gate_events(robot, longer), "oscillation");
  ASSERT_FALSE(swings.empty());
  EXPECT_NEAR(swings[0].begin_s, 6.0, 1.1);
  EXPECT_NEAR(swings[0].end_s, 10.0, 1.1);
  EXPECT_EQ(swings[0].cable, -1);
  // Another set-point in between: the platform was moved.
  for (Eigen::Index i = 70; i < 90; ++i) longer.tension_setpoint_N(i, 0) += 1.0;
  EXPECT_TRUE(named(gate_events(robot, longer), "oscillation").empty());
}

TEST_F(Events, ASwingTooShortToEndARestIsSeenInItsScatter) {
  struct Swing {
    LogMatrix Log::* group;
    int column;
    double sigma;
  };
  const SensorSigma& s = robot.sigma;
  const Log calm = with_long_rest(log, s);
  Log same = calm;
  same.length_m(70, 0) += s.length_m;  // five times its noise, once, is none
  EXPECT_TRUE(gate_events(robot, same).empty());
  for (const Swing& swing :
       {Swing{&Log::length_m, 0, s.length_m}, Swing{&Log::length_m, 3, s.length_m},
        Swing{&Log::swivel_rad, 1, s.swivel_rad},
        Swing{&Log::roll_pitch_yaw_rad, 2, s.attitude_rad}}) {
    Log longer = calm;
    // For 2 s; the quiet spells on both sides are at the same place, which makes them one rest.
    for (Eigen::Index i = 60; i < 80; ++i) {
      (longer.*swing.group)(i, swing.column) +=
          2.0 * swing.sigma * std::sin(0.6 * static_cast<double>(i - 60));
    }
    const std::vector<Equilibrium> rests = detect_equilibria(longer, {0, longer.sample_count()}, s);
    ASSERT_LT(rests.front().begin_s, 5.0);
    ASSERT_GT(rests.front().end_s, 11.0);
    const auto swings = named(gate_events(robot, longer), "oscillation");
    ASSERT_EQ(swings.size(), 1U) << swing.column;
    EXPECT_NEAR(swings[0].begin_s, 6.0, 1.1);  // windows of a second that hold some of it
    EXPECT_LE(swings[0].begin_s, 6.0);
    EXPECT_EQ(swings[0].cable, -1);
    EXPECT_NEAR(swings[0].end_s, 8.0, 1.1);
    EXPECT_GE(swings[0].end_s, 7.8);
    // The same written a whole turn further from the middle of it on is the same.
    if (swing.group == &Log::length_m) continue;
    (longer.*swing.group).col(swing.column).tail(longer.sample_count() - 70).array() +=
        2.0 * std::numbers::pi;
    const auto turned = named(gate_events(robot, longer), "oscillation");
    ASSERT_EQ(turned.size(), 1U);
    EXPECT_EQ(turned[0].begin_s, swings[0].begin_s);
    EXPECT_EQ(turned[0].end_s, swings[0].end_s);
  }
}

/// One reading of a channel and where it stands in the log.
struct Reading {
  std::string channel;
  LogMatrix Log::* group;
  int column, cable;
  double sigma;
};

std::vector<Reading> readings(const SensorSigma& s) {
  return {{"length", &Log::length_m, 3, 3, s.length_m},
          {"swivel", &Log::swivel_rad, 1, 1, s.swivel_rad},
          {"tension", &Log::tension_N, 0, 0, s.tension_N},
          {"roll", &Log::roll_pitch_yaw_rad, 0, -1, s.attitude_rad},
          {"pitch", &Log::roll_pitch_yaw_rad, 1, -1, s.attitude_rad},
          {"yaw", &Log::roll_pitch_yaw_rad, 2, -1, s.attitude_rad}};
}

TEST_F(Events, AnOutlierIsNamedByItsChannelCableTimeAndSize) {
  constexpr Eigen::Index kRest = 20;  // while the platform rests
  for (const Reading& reading : readings(robot.sigma)) {
    SCOPED_TRACE(reading.channel);
    for (const double side : {1.0, -1.0}) {
      Log one = log;
      (one.*reading.group)(kRest, reading.column) += side * 8.0 * reading.sigma;
      const auto events = gate_events(robot, one);
      ASSERT_EQ(events.size(), 1U);
      EXPECT_EQ(events[0].name, "outlier");
      EXPECT_EQ(events[0].channel, reading.channel);
      EXPECT_EQ(events[0].cable, reading.cable);
      EXPECT_EQ(events[0].begin_s, log.time_s[kRest]);
      EXPECT_EQ(events[0].end_s, log.time_s[kRest]);
      EXPECT_NEAR(events[0].size, side * 8.0 * reading.sigma, 1.0 * reading.sigma);
      EXPECT_TRUE(std::isnan((one.*reading.group)(kRest, reading.column)));
      // Nothing else is taken out of the log.
      (one.*reading.group)(kRest, reading.column) = (log.*reading.group)(kRest, reading.column);
      EXPECT_EQ(one.*reading.group, log.*reading.group);
    }
  }
}

TEST_F(Events, TwoReadingsInARowAreOneOutlierAndMoreAreMotion) {
  for (const int count : {2, 3, 4}) {
    SCOPED_TRACE(count);
    Log some = log;
    some.length_m.col(1).segment(20, count).array() += 0.1;  // at rest
    const auto outliers = named(gate_events(robot, some), "outlier");
    if (count > 2) {
      EXPECT_TRUE(outliers.empty());
      EXPECT_TRUE(some.length_m.allFinite());
      continue;
    }
    ASSERT_EQ(outliers.size(), 1U);
    EXPECT_EQ(outliers[0].begin_s, log.time_s[20]);
    EXPECT_EQ(outliers[0].end_s, log.time_s[21]);
    EXPECT_EQ(some.length_m.array().isNaN().count(), 2);
  }
}

TEST_F(Events, WhatIsWithinOneSigmaDoesNoHarmHoweverQuietTheSensor) {
  const Log quiet = startup_log(robot, 0.01, 6, 0);
  for (const double sigmas : {0.8, 1.3}) {
    Log one = quiet;
    one.length_m(20, 2) += sigmas * robot.sigma.length_m;
    EXPECT_EQ(named(gate_events(robot, one), "outlier").size(), sigmas > 1.0 ? 1U : 0U) << sigmas;
  }
}

TEST_F(Events, ByChanceAReadingIsOffByMoreThanOneSigma) {
  // Seven times the noise: less than eight, whatever is said of sigma.
  const Log loud = startup_log(robot, 0.5, 7, 0);
  for (const double times : {6.0, 11.0}) {
    Log one = loud;
    const double middle = one.length_m.col(0).segment(15, 11).mean();
    one.length_m(20, 0) =
        middle + times * channel_noise(loud.length_m.col(0).head(loud.sample_count()));
    EXPECT_EQ(named(gate_events(robot, one), "outlier").size(), times > 8.0 ? 1U : 0U) << times;
  }
}

TEST_F(Events, TheEndsOfARunAreJudgedToo) {
  Log ends = log;
  const Eigen::Index last = log.sample_count() - 1;
  ends.length_m(0, 0) += 0.5;
  ends.length_m(last, 1) += 0.5;
  EXPECT_EQ(named(gate_events(robot, ends), "outlier").size(), 2U);
  EXPECT_TRUE(std::isnan(ends.length_m(0, 0)) && std::isnan(ends.length_m(last, 1)));
}

TEST_F(Events, ASlackCableIsToldWithItsTimeAndLeastTension) {
  const double limit_N = 0.5 * robot.tension_min_N;
  for (Eigen::Index i = 20; i < 30; ++i) {
    log.tension_N(i, 3) = limit_N * (i == 24 ? 0.02 : 0.06);
  }
  log.tension_N(40, 1) = 1.01 * limit_N;  // above: not slack
  const auto slack = named(gate_events(robot, log), "slack");
  ASSERT_EQ(slack.size(), 1U);
  EXPECT_EQ(slack[0].cable, 3);
  EXPECT_EQ(slack[0].channel, "tension");
  EXPECT_EQ(slack[0].begin_s, log.time_s[20]);
  EXPECT_EQ(slack[0].end_s, log.time_s[29]);
  EXPECT_EQ(slack[0].size, 0.02 * limit_N);
  EXPECT_EQ(log.tension_N(24, 3), 0.02 * limit_N);  // its readings stay
}

TEST_F(Events, ATensionThatPassesZeroForOneSampleOnItsWayIsNotSlack) {
  // Down and up again over a second: no outlier, and nothing that stayed.
  const double limit_N = 0.5 * robot.tension_min_N;
  for (Eigen::Index k = -5; k <= 5; ++k) {
    log.tension_N(60 + k, 3) = 0.1 * limit_N + limit_N * static_cast<double>(std::abs(k));
  }
  EXPECT_TRUE(named(gate_events(robot, log), "slack").empty());
  log.tension_N(61, 3) = 0.1 * limit_N;
  EXPECT_EQ(named(gate_events(robot, log), "slack").size(), 1U);
}

TEST_F(Events, WhereACablePushesLoadCellsAreOffByUpToTheirSigma) {
  log.tension_N.col(3).segment(20, 10).setConstant(0.5);
  ASSERT_EQ(named(gate_events(robot, log), "slack").size(), 1U);
  // 20 N are allowed, and sigma is 10 N: three of them make -10 N of that, and less is slack.
  Log pushing = log;
  pushing.tension_N.col(1).segment(60, 10).setConstant(-15.0);
  const auto slack = named(gate_events(robot, pushing), "slack");
  ASSERT_EQ(slack.size(), 1U);
  EXPECT_EQ(slack[0].cable, 1);
  Robot noisy = robot;
  noisy.sigma.tension_N = 15.0;
  EXPECT_TRUE(named(gate_events(noisy, pushing), "slack").empty());
}

TEST_F(Events, EveryCableIsLookedAt) {
  for (int c = 0; c < 4; ++c) {
    Log slack = log, swivel = log, length = log, tension = log;
    slack.tension_N.col(c).segment(20, 5).setConstant(0.3);
    EXPECT_EQ(named(gate_events(robot, slack), "slack").size(), 1U) << c;
    swivel.swivel_rad(20, c) += 0.5;
    length.length_m(20, c) += 0.5;
    tension.tension_N(20, c) += 80.0;
    for (Log* one : {&swivel, &length, &tension}) {
      const auto outliers = named(gate_events(robot, *one), "outlier");
      ASSERT_EQ(outliers.size(), 1U) << c;
      EXPECT_EQ(outliers[0].cable, c);
    }
  }
}

TEST_F(Events, AWholeTurnIsNothingForAnAngleAndMuchForTheOthers) {
  const double turn = 2.0 * std::numbers::pi;
  log.swivel_rad(20, 1) += turn;
  for (int c = 0; c < 3; ++c) log.roll_pitch_yaw_rad(20, c) -= turn;
  EXPECT_TRUE(gate_events(robot, log).empty());
  log.length_m(20, 0) += turn;
  log.tension_N(30, 2) += 40.0 * turn;
  EXPECT_EQ(named(gate_events(robot, log), "outlier").size(), 2U);
}

TEST_F(Events, WithoutSetPointsRestsOfOneSetPointAreNotKnown) {
  Log longer = with_long_rest(log, robot.sigma);
  for (Eigen::Index i = 60; i < 100; ++i) {
    longer.length_m.row(i).array() += 0.03 * std::sin(0.4 * static_cast<double>(i - 60));
  }
  longer.tension_setpoint_N.resize(longer.sample_count(), 0);
  EXPECT_TRUE(named(gate_events(robot, longer), "oscillation").empty());
}

TEST_F(Events, ARestMayEndInMotion) {
  // What moves within a second of the ends of a rest is the way there, or on.
  Log longer = with_long_rest(log, robot.sigma);
  const std::vector<Equilibrium> rests =
      detect_equilibria(longer, {0, longer.sample_count()}, robot.sigma);
  for (const Eigen::Index from : {rests[0].samples.begin, rests[0].samples.end - 8}) {
    Log one = longer;
    for (Eigen::Index i = from; i < from + 8; ++i) {
      one.length_m(i, 0) += 2.0 * robot.sigma.length_m * std::sin(0.8 * static_cast<double>(i));
    }
    EXPECT_TRUE(named(gate_events(robot, one), "oscillation").empty()) << from;
  }
}

TEST_F(Events, ARunIsTheLastSegment) {
  // What happened before a gap of ten seconds is not looked at.
  log.length_m(20, 0) += 0.5;
  log.time_s.tail(log.sample_count() - 40).array() += 10.0;
  EXPECT_TRUE(named(gate_events(robot, log), "outlier").empty());
  log.length_m(100, 0) += 0.5;
  const auto outliers = named(gate_events(robot, log), "outlier");
  ASSERT_EQ(outliers.size(), 1U);
  EXPECT_EQ(outliers[0].begin_s, log.time_s[100]);
  EXPECT_TRUE(std::isnan(log.length_m(100, 0)));
}

TEST_F(Events, ComeInTheOrderOfTime) {
  log.roll_pitch_yaw_rad(30, 0) += 0.5;
  log.length_m(100, 0) += 0.5;
  log.swivel_rad(60, 2) += 0.5;
  const auto events = gate_events(robot, log);
  ASSERT_EQ(events.size(), 3U);
  EXPECT_EQ(events[0].channel, "roll");
  EXPECT_EQ(events[1].channel, "swivel");
  EXPECT_EQ(events[2].channel, "length");
}

TEST_F(Events, AreDescribedForPeople) {
  EXPECT_EQ(describe({"outlier", 3.0, 3.0, 1, "length", 0.1234}),
            "outlier at 3.00 s, length of cable 2 (+0.1234): left out");
  EXPECT_EQ(describe({"outlier", 3.0, 3.0, 0, "swivel", 1.0}),
            "outlier at 3.00 s, swivel of cable 1 (+1): left out");
  EXPECT_EQ(describe({"outlier", 3.0, 3.0, -1, "yaw", -0.5}),
            "outlier at 3.00 s, yaw (-0.5): left out");
  EXPECT_EQ(describe({"slack", 1.0, 2.5, 0, "tension", 0.25}),
            "slack from 1.00 to 2.50 s, cable 1 (down to 0.2 N): its balance is left out");
  EXPECT_EQ(describe({"slack", 1.0, 1.0, 3, "tension", 0.75}),
            "slack at 1.00 s for less than two samples, cable 4 (0.8 N, and the platform jerks): "
            "left out");
  EXPECT_EQ(describe({"oscillation", 4.0, 6.0, -1, "", 0.0}),
            "oscillation from 4.00 to 6.00 s at one set-point");
}

}  // namespace
}  // namespace cdprcal
