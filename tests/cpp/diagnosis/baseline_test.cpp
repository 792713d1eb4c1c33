// The diagnosis' starting point: what is made of logs before anything is looked for.
#include "cdprcal/diagnosis/baseline.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "../support/dense.hpp"
#include "../support/run.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

using test::startup_log;

DiagnosisModel baseline_of(const Robot& robot, std::vector<Log> logs) {
  std::vector<std::string> left_out;
  return baseline_model(robot, logs, left_out);
}

class Baseline : public testing::Test {
 protected:
  const Robot robot = load_robot("irma4");
  Log log = startup_log(robot, 0.2, 101, 0);
};

TEST_F(Baseline, MeasurementsAreMeansOverTheirRests) {
  const DiagnosisModel model = baseline_of(robot, {log});
  ASSERT_EQ(model.runs.size(), 1U);
  const DiagnosisRun& run = model.runs[0];
  EXPECT_EQ(run.name, log.source);
  ASSERT_EQ(run.rows.size(), run.measurements.size());
  ASSERT_EQ(run.poses.size(), run.measurements.size());
  double samples = 0.0;
  for (std::size_t i = 0; i < run.rows.size(); ++i) {
    const SampleRange& rows = run.rows[i];
    const Measurement& m = run.measurements[i];
    // Of the middle of the rest, without the ends at which it passes into motion.
    bool of_the_rest = false;
    for (Eigen::Index first = rows.begin; first + m.samples <= rows.end; ++first) {
      const Eigen::VectorXd mean = log.length_m.middleRows(first, m.samples).colwise().mean();
      of_the_rest = of_the_rest || (m.length_m - mean).norm() < 1e-12;
    }
    EXPECT_TRUE(of_the_rest) << i;
    EXPECT_GE(2 * m.samples, rows.size()) << i;
    samples += m.samples;
    if (i > 0) {
      EXPECT_GE(rows.begin, run.rows[i - 1].end);
    }
  }
  EXPECT_NEAR(model.rest_samples, samples / static_cast<double>(run.rows.size()), 1e-9);
  EXPECT_TRUE(run.known.empty());
}

TEST_F(Baseline, TheFloorIsTheReadingsOwnRippleInTheMeanOverARest) {
  const Log other = startup_log(robot, 0.3, 102, 0);
  const DiagnosisModel model = baseline_of(robot, {log, other});
  // The middle one of a channel's cables or angles; mean squares over the logs.
  const auto ripple = [&](LogMatrix Log::* group, int from, int count, bool angles) {
    double sum = 0.0;
    for (const Log* l : std::initializer_list<const Log*>{&log, &other}) {
      std::vector<double> noise;
      for (int c = from; c < from + count; ++c) {
        noise.push_back(channel_noise((l->*group).col(c), angles));
      }
      std::sort(noise.begin(), noise.end());
      sum += std::pow(noise[noise.size() / 2], 2);
    }
    return std::sqrt(sum / 2.0);
  };
  const SensorSigma& s = robot.sigma;
  const std::array<double, 5> reading{
      ripple(&Log::length_m, 0, 4, false), ripple(&Log::swivel_rad, 0, 4, true),
      ripple(&Log::roll_pitch_yaw_rad, 0, 2, true), ripple(&Log::roll_pitch_yaw_rad, 2, 1, true),
      ripple(&Log::tension_N, 0, 4, false)};
  for (std::size_t c = 0; c < 5; ++c) {
    const double unit = c == 4 ? s.tension_N : 1.0;  // relative to the balance's covariance
    EXPECT_NEAR(model.floor[c], reading[c] / std::sqrt(model.rest_samples) / unit,
                1e-9 * model.floor[c]);
    EXPECT_GE(model.noise[c], model.floor[c]);
    if (c < 4) {
      EXPECT_NEAR(model.floor[c + kRestGroups], reading[c], 1e-9 * reading[c]);
    }
  }
  // Nothing was read in motion: the robot file's word stands.
  const std::array<double, 4> sigma{s.length_m, s.swivel_rad, s.attitude_rad, s.attitude_rad};
  for (std::size_t c = 0; c < 4; ++c) EXPECT_EQ(model.noise[c + kRestGroups], sigma[c]);
}

TEST_F(Baseline, ExactReadingsKeepAThousandthOfSigma) {
  const DiagnosisModel model = baseline_of(robot, {startup_log(robot, 0.0, 103, 0)});
  const SensorSigma& s = robot.sigma;
  const std::array<double, 4> sigma{s.length_m, s.swivel_rad, s.attitude_rad, s.attitude_rad};
  for (std::size_t c = 0; c < 4; ++c) {
    EXPECT_EQ(model.floor[c], 1e-3 * sigma[c]);
    EXPECT_EQ(model.floor[c + kRestGroups], 1e-3 * sigma[c]);
  }
  EXPECT_EQ(model.floor[4], 1e-3);
}

TEST_F(Baseline, OffsetsAreWhatTheReadingsAreAheadOfTheModel) {
  const DiagnosisModel model = baseline_of(robot, {log});
  Log shifted = log;
  shifted.length_m.col(2).array() += 0.7;
  shifted.swivel_rad.col(1).array() -= 0.4;
  shifted.roll_pitch_yaw_rad.col(2).array() += 1.3;
  const DiagnosisModel moved = baseline_of(robot, {shifted});
  Eigen::VectorXd expected = model.runs[0].offsets;
  expected[2] += 0.7;
  expected[4 + 1] -= 0.4;
  expected[8] += 1.3;
  for (int i = 0; i < 9; ++i) {
    const double off = moved.runs[0].offsets[i] - expected[i];
    EXPECT_NEAR(i < 4 ? off : wrap_angle(off), 0.0, 1e-5) << i;
  }
}

TEST_F(Baseline, WhereACableHangsSlackItsTensionSaysNothing) {
  const double limit_N = 0.5 * robot.tension_min_N;
  const DiagnosisModel before = baseline_of(robot, {log});
  const SampleRange rest = before.runs[0].rows[3];
  log.tension_N.col(1).segment(rest.begin, rest.size()).setConstant(0.5 * limit_N);
  std::vector<Log> logs{log};
  std::vector<std::string> left_out;
  const DiagnosisModel model = baseline_model(robot, logs, left_out);
  for (const Measurement& m : model.runs[0].measurements) {
    const bool there = m.time_s > log.time_s[rest.begin] && m.time_s < log.time_s[rest.end - 1];
    EXPECT_TRUE(std::isfinite(m.tension_N[0])) << m.time_s;
    EXPECT_EQ(m.in_balance(), !there);
  }
  ASSERT_EQ(left_out.size(), 1U);
  EXPECT_EQ(left_out[0].find(log.source + ": slack from "), 0U) << left_out[0];
  EXPECT_NE(left_out[0].find("cable 2"), std::string::npos);
  // The first cable is looked at as well; a little above the limit a cable is taut.
  for (const double share : {0.95, 1.05}) {
    Log first = startup_log(robot, 0.2, 101, 0);
    first.tension_N.col(0).segment(rest.begin, rest.size()).setConstant(share * limit_N);
    const Measurement m = baseline_of(robot, {first}).runs[0].measurements[3];
    EXPECT_EQ(m.in_balance(), share > 1.0);
  }
}

TEST_F(Baseline, KnownEffectsAreHeldAtTheirValues) {
  Robot known = robot;
  known.effects.push_back({"load_cell_bias", "", {{"bias_N", {5, -4, 3, -2}}}});
  log.tension_N.rowwise() += Eigen::RowVector4d(5, -4, 3, -2);
  const DiagnosisModel model = baseline_of(known, {log});
  ASSERT_EQ(model.runs[0].known.size(), 1U);
  EXPECT_EQ(model.runs[0].known[0].values, Eigen::Vector4d(5, -4, 3, -2));
  EXPECT_TRUE(model.effects.empty());
  // With it the balance is as quiet as that of load cells without a bias.
  const DiagnosisModel clean = baseline_of(robot, {startup_log(robot, 0.2, 101, 0)});
  EXPECT_NEAR(model.noise[4], clean.noise[4], 1e-3 * clean.noise[4]);
}

TEST_F(Baseline, ALoadCellKnownToReadTooLittleIsNoSlackCable) {
  Robot known = robot;
  known.effects.push_back({"load_cell_bias", "", {{"bias_N", {-200, 0, 0, 60}}}});
  const DiagnosisModel clean = baseline_of(robot, {log});
  log.tension_N.rowwise() += Eigen::RowVector4d(-200, 0, 0, 60);
  ASSERT_LT(log.tension_N.col(0).minCoeff(), 0.0);
  std::vector<Log> logs{log};
  std::vector<std::string> left_out;
  const DiagnosisModel model = baseline_model(known, logs, left_out);
  EXPECT_TRUE(left_out.empty()) << left_out.front();
  for (const Measurement& m : model.runs[0].measurements) EXPECT_TRUE(m.in_balance());
  EXPECT_NEAR(model.noise[4], clean.noise[4], 1e-3 * clean.noise[4]);
  // One that reads too much hides a slack cable no more.
  const SampleRange rest = model.runs[0].rows[3];
  logs[0].tension_N.col(3).segment(rest.begin, rest.size()).setConstant(60.5);
  baseline_model(known, logs, left_out);
  ASSERT_EQ(left_out.size(), 1U);
  EXPECT_NE(left_out[0].find("cable 4 (down to 0.5 N)"), std::string::npos) << left_out[0];
}

TEST_F(Baseline, ALogWithoutLoadCellsHasWhatNoTensionCanBalance) {
  const int rests = baseline_of(robot, {log}).pose_count();
  log.tension_N.resize(log.sample_count(), 0);
  log.tension_setpoint_N.resize(log.sample_count(), 0);
  const DiagnosisModel model = baseline_of(robot, {log});
  const DiagnosisSystem system = linearise(model);
  for (const test::PoseSystem& pose : test::poses_of(system)) {
    EXPECT_EQ(std::ranges::count(pose.channel, at_rest(Channel::balance)), 2);
  }
  // Few sensors can tell whether it is better than the robot file says.
  EXPECT_GE(model.noise[4], 1.0);
  // It has its rests all the same: as many as with load cells.
  EXPECT_EQ(model.pose_count(), rests);
}

TEST_F(Baseline, SamplesInMotionAreOneRowEach) {
  // One rest tells too little without load cells: then samples count one by one.
  const DiagnosisModel at_rest = baseline_of(robot, {log});
  const Eigen::Index until = at_rest.runs[0].rows[1].begin;
  Log moving = test::cut(log, 0, until);
  moving.tension_N.resize(moving.sample_count(), 0);
  moving.tension_setpoint_N.resize(moving.sample_count(), 0);
  const DiagnosisRun run = baseline_of(robot, {moving}).runs[0];
  ASSERT_EQ(run.rows.size(), run.measurements.size());
  for (std::size_t i = 0; i < run.rows.size(); ++i) {
    ASSERT_EQ(run.rows[i].size(), 1) << i;
    EXPECT_EQ(log.time_s[run.rows[i].begin], run.measurements[i].time_s) << i;
  }
}

TEST_F(Baseline, ALogThatBeginsInMotionHasOneSampleThenItsRests) {
  const DiagnosisModel whole = baseline_of(robot, {log});
  const Eigen::Index from = whole.runs[0].rows[0].end + 12;  // into the first move
  const Log later = test::cut(log, from, log.sample_count() - from);
  const DiagnosisRun run = baseline_of(robot, {later}).runs[0];
  ASSERT_EQ(run.rows.size(), whole.runs[0].rows.size());
  EXPECT_EQ(run.measurements[0].kind, PoseKind::kinematic_pose);
  EXPECT_EQ(run.rows[0].begin, 0);
  EXPECT_EQ(run.rows[0].end, 1);
  for (std::size_t i = 1; i < run.rows.size(); ++i) {
    EXPECT_EQ(run.measurements[i].kind, PoseKind::static_pose);
    EXPECT_NEAR(static_cast<double>(run.rows[i].begin + from),
                static_cast<double>(whole.runs[0].rows[i].begin), 2.0);
    EXPECT_GT(run.rows[i].size(), 10);
  }
}

TEST(BaselineInMotion, MomentsThatShareTheirErrorsWithTheirNeighboursAreFewer) {
  // Encoders alone of eight cables that never rest.
  const Robot robot = load_robot("posts8");
  const auto moments_where = [&](double shared, double own) {
    constexpr int kSamples = 1200;
    constexpr double kNoise_m = 2e-3, kOften = 0.05;
    RandomNormal random(3);
    Log log;
    log.source = "moving";
    log.time_s = 0.1 * Eigen::VectorXd::LinSpaced(kSamples, 0.0, kSamples - 1.0);
    log.length_m.resize(kSamples, robot.cable_count());
    for (int i = 0; i < kSamples; ++i) {
      const double t = log.time_s[i];
      Pose pose;
      pose.position_m = Vector3(0.4 * std::sin(0.11 * t), 0.4 * std::sin(0.17 * t + 1.0),
                                1.0 + 0.3 * std::sin(0.13 * t + 2.0));
      pose.rotation = exp_so3(
          0.2 * Vector3(std::sin(0.19 * t), std::sin(0.23 * t + 1.0), std::sin(0.29 * t + 2.0)));
      const CableVector length_m = platform_state(robot, pose).length_m();
      for (int c = 0; c < robot.cable_count(); ++c) {
        const double slow = std::sqrt(2.0) * std::sin(2.0 * kPi * kOften * t + 1.7 * c);
        log.length_m(i, c) = length_m[c] + kNoise_m * (shared * slow + own * random());
      }
    }
    log.length_m.rowwise() -= log.length_m.row(0).eval();
    std::vector<Log> logs{log};
    std::vector<std::string> left_out;
    return baseline_model(robot, logs, left_out).runs[0].measurements.size();
  };
  const std::size_t independent = moments_where(0.0, 1.0), alike = moments_where(1.0, 0.2);
  EXPECT_GT(independent, 100U);
  EXPECT_LT(3 * alike, 2 * independent);
  EXPECT_GE(alike, 30U);  // enough to tell an effect
}

}  // namespace
}  // namespace cdprcal
