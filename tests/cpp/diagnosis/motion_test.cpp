// Samples in motion, and what only they show: a run of which the truth is known at every sample.
#include "cdprcal/diagnosis/motion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../support/dense.hpp"
#include "../support/run.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/diagnosis/baseline.hpp"
#include "cdprcal/diagnosis/search.hpp"

namespace cdprcal {
namespace {

using test::summary;

/// Eight rests of irma4 and the moves between them at 10 Hz, exact readings.
const SyntheticLog& truth() {
  static const SyntheticLog made = [] {
    const Robot robot = load_robot("irma4");
    SyntheticLogOptions options;
    options.dwell_s = 4.0;
    options.move_s = 4.0;
    options.seed = 91;
    return synthetic_log(robot, default_setpoints(robot, 2, 2, 2), options);
  }();
  return made;
}

/// White noise of `scale` σ on every reading.
Log noisy(Log log, double scale, std::uint64_t seed) {
  const SensorSigma sigma = load_robot("irma4").sigma;
  RandomNormal random(seed);
  const auto add = [&](LogMatrix& readings, double deviation) {
    for (double& v : readings.reshaped<Eigen::RowMajor>()) v += scale * deviation * random();
  };
  add(log.length_m, sigma.length_m);
  add(log.swivel_rad, sigma.swivel_rad);
  add(log.tension_N, sigma.tension_N);
  add(log.roll_pitch_yaw_rad, sigma.attitude_rad);
  return log;
}

/// Attitude as it was `delay_s` before, along the true motion.
Log delayed(Log log, double delay_s, LogMatrix Log::* angles = &Log::roll_pitch_yaw_rad) {
  const LogMatrix read = log.*angles;
  for (Eigen::Index i = 0; i < read.rows(); ++i) {
    const double at = std::max(0.0, static_cast<double>(i) - 10.0 * delay_s);
    const auto before = static_cast<Eigen::Index>(at);
    const Eigen::Index after = std::min(before + 1, read.rows() - 1);
    const double fraction = at - static_cast<double>(before);
    for (Eigen::Index c = 0; c < read.cols(); ++c) {
      (log.*angles)(i, c) =
          read(before, c) + fraction * wrap_angle(read(after, c) - read(before, c));
    }
  }
  return log;
}

DiagnosisModel baseline_in_motion(Log log) {
  std::vector<Log> logs{std::move(log)};
  std::vector<std::string> left_out;
  return baseline_model(load_robot("irma4"), logs, left_out);
}

/// Every `step`-th sample.
Log thinned(const Log& log, Eigen::Index step) {
  Log out;
  out.source = log.source;
  const auto rows = Eigen::seq(Eigen::Index{0}, log.sample_count() - 1, step);
  out.time_s = log.time_s(rows);
  out.length_m = log.length_m(rows, Eigen::all);
  out.swivel_rad = log.swivel_rad(rows, Eigen::all);
  out.tension_N = log.tension_N(rows, Eigen::all);
  out.tension_setpoint_N = log.tension_setpoint_N(rows, Eigen::all);
  out.roll_pitch_yaw_rad = log.roll_pitch_yaw_rad(rows, Eigen::all);
  return out;
}

class Motion : public testing::Test {
 protected:
  static const DiagnosisModel& exact() {
    static const DiagnosisModel model = baseline_in_motion(truth().log);
    return model;
  }
  static const Log& read() {
    static const Log log = noisy(truth().log, 0.2, 92);
    return log;
  }
  static const DiagnosisModel& plain() {
    static const DiagnosisModel model = baseline_in_motion(read());
    return model;
  }
};

TEST_F(Motion, SamplesStandWhereThePlatformWas) {
  const Log& log = truth().log;
  const DiagnosisModel moving = with_motion(exact(), {log});
  const DiagnosisRun& before = exact().runs[0];
  const DiagnosisRun& run = moving.runs[0];
  ASSERT_GT(run.poses.size(), before.poses.size() + 100);
  ASSERT_EQ(run.measurements.size(), run.poses.size());
  ASSERT_EQ(run.rows.size(), run.poses.size());
  for (std::size_t i = 0; i < before.poses.size(); ++i) {
    EXPECT_EQ(run.poses[i].position_m, before.poses[i].position_m);
  }
  for (std::size_t i = before.poses.size(); i < run.poses.size(); ++i) {
    const Eigen::Index row = run.rows[i].begin;
    EXPECT_EQ(run.rows[i].size(), 1);
    const Measurement& m = run.measurements[i];
    EXPECT_EQ(m.kind, PoseKind::kinematic_pose);
    EXPECT_EQ(m.samples, 1);
    EXPECT_EQ(m.run_time_s, log.time_s[row] - log.time_s[0]);
    EXPECT_EQ(m.length_m, log.length_m.row(row).transpose());
    const Vector6 off = minus(run.poses[i], truth().poses[static_cast<std::size_t>(row)]);
    EXPECT_LT(off.norm(), 1e-4) << row;  // as far as the baseline's offsets are exact
  }
}

TEST_F(Motion, SamplesStandWhereTheirOwnReadingsWantThemMost) {
  // Every kind of reading, each with its own weight: the pose is the weighted least squares' one.
  const Robot robot = load_robot("irma4");
  SyntheticLogOptions options;
  options.noise = reading_noise(robot.sigma, 0.3, true);
  options.dwell_s = options.move_s = 4.0;
  options.seed = 96;
  const Log log = synthetic_log(robot, default_setpoints(robot, 2, 2, 2), options).log;
  DiagnosisModel model = baseline_in_motion(log);
  for (std::size_t c = 0; c < kRestGroups; ++c) {
    model.noise[c + kRestGroups] *= 0.4 + 0.3 * static_cast<double>((5 * c) % 7);
  }
  const DiagnosisModel moving = with_motion(model, {log});
  const std::size_t rests = model.runs[0].poses.size();
  ASSERT_GT(moving.runs[0].poses.size(), rests + 20);
  for (const test::PoseSystem& pose : test::poses_of(linearise(moving))) {
    if (pose.pose < rests) continue;
    ASSERT_EQ(pose.residual.size(), 4 + 4 + 3 + 1 + 4 + 3);
    const Vector6 pull = pose.by_pose.transpose() * pose.residual;
    const Vector6 most = pose.by_pose.colwise().norm().transpose() * pose.residual.norm();
    for (int i = 0; i < 6; ++i) EXPECT_LT(std::abs(pull[i]), 1e-4 * most[i]) << pose.pose;
  }
}

TEST_F(Motion, ReadingsThatLackAreDoneWithoutAndTooFewFollowNothing) {
  Log log = truth().log;
  log.swivel_rad.col(1).setConstant(kNaN);
  log.roll_pitch_yaw_rad.col(2).setConstant(kNaN);
  const DiagnosisModel moving = with_motion(exact(), {log});
  const std::size_t rests = exact().runs[0].poses.size();
  ASSERT_GT(moving.runs[0].poses.size(), rests + 100);
  for (std::size_t i = rests; i < moving.runs[0].poses.size(); ++i) {
    const auto row = static_cast<std::size_t>(moving.runs[0].rows[i].begin);
    EXPECT_LT(minus(moving.runs[0].poses[i], truth().poses[row]).norm(), 1e-3) << row;
  }
  // From a pose that cannot be evaluated nothing is followed either.
  DiagnosisModel nowhere = exact();
  nowhere.runs[0].poses[0].position_m.setConstant(kNaN);
  EXPECT_EQ(with_motion(nowhere, {truth().log}).pose_count(), exact().pose_count());
  // Four lengths and no angle at all leave two directions open.
  log.swivel_rad.setConstant(kNaN);
  log.roll_pitch_yaw_rad.setConstant(kNaN);
  EXPECT_EQ(with_motion(exact(), {log}).pose_count(), exact().pose_count());
}

TEST_F(Motion, TheFastestSamplesAreTakenAtTheirSpacing) {
  constexpr MotionOptions kFew{.most_samples = 12, .least_spacing_s = 0.55};
  const Log& log = read();
  const std::size_t rests = plain().runs[0].poses.size();
  const DiagnosisModel moving = with_motion(plain(), {log}, kFew);
  std::vector<Eigen::Index> kept;
  for (std::size_t i = rests; i < moving.runs[0].rows.size(); ++i) {
    kept.push_back(moving.runs[0].rows[i].begin);
  }
  ASSERT_EQ(kept.size(), 12U);
  const LogMatrix rate = path_state(load_robot("irma4"), log).attitude_rate_rad_s;
  const auto speed = [&](Eigen::Index row) { return rate.row(row).norm(); };
  double slowest = 1e300;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    slowest = std::min(slowest, speed(kept[i]));
    if (i > 0) {  // in the order of time
      EXPECT_GT(log.time_s[kept[i]] - log.time_s[kept[i - 1]], 0.55);
    }
  }
  for (Eigen::Index row = 0; row < log.sample_count(); ++row) {
    const bool faster_nearby = std::any_of(kept.begin(), kept.end(), [&](Eigen::Index other) {
      return std::abs(log.time_s[other] - log.time_s[row]) < 0.55 && speed(other) >= speed(row);
    });
    EXPECT_TRUE(faster_nearby || speed(row) <= slowest) << row;
  }
}

TEST_F(Motion, WhatWasReadAtRestIsNotCountedAgain) {
  const DiagnosisModel moving = with_motion(plain(), {read()}, {.least_spacing_s = 0.3});
  const DiagnosisRun& run = moving.runs[0];
  const std::size_t rests = plain().runs[0].rows.size();
  ASSERT_GT(run.rows.size(), rests);
  for (std::size_t i = rests; i < run.rows.size(); ++i) {
    for (std::size_t k = 0; k < rests; ++k) {
      EXPECT_FALSE(run.rows[k].begin <= run.rows[i].begin && run.rows[i].begin < run.rows[k].end);
    }
  }
}

TEST_F(Motion, WithoutALimitItIsEverySampleBetweenTheRests) {
  const DiagnosisModel moving =
      with_motion(plain(), {read()}, {.most_samples = 100000, .least_spacing_s = 0.0});
  const DiagnosisRun& run = moving.runs[0];
  const std::size_t rests = plain().runs[0].rows.size();
  std::vector<Eigen::Index> expected, taken;
  for (Eigen::Index row = 0; row < read().sample_count(); ++row) {
    if (std::none_of(run.rows.begin(), run.rows.begin() + static_cast<std::ptrdiff_t>(rests),
                     [&](const SampleRange& r) { return row >= r.begin && row < r.end; })) {
      expected.push_back(row);
    }
  }
  for (std::size_t i = rests; i < run.rows.size(); ++i) taken.push_back(run.rows[i].begin);
  EXPECT_EQ(taken, expected);
}

TEST_F(Motion, TheClockMayBeginAnywhere) {
  Log late = read();
  late.time_s.array() += 1e4;
  EXPECT_EQ(with_motion(plain(), {late}).pose_count(), with_motion(plain(), {read()}).pose_count());
}

TEST_F(Motion, RunsTooShortOrTooSlowlyReadAddNothing) {
  EXPECT_EQ(with_motion(plain(), {thinned(read(), 4)}).pose_count(), plain().pose_count());
  EXPECT_GT(with_motion(plain(), {thinned(read(), 3)}).pose_count(), plain().pose_count());
  const Log two = test::cut(read(), 60, 2);  // of a move
  EXPECT_EQ(with_motion(plain(), {two}).pose_count(), plain().pose_count());
}

/// What successive samples in motion leave, off their poses: from the rows, without projections.
double correlation_of(const DiagnosisModel& model) {
  double products = 0.0, squares = 0.0;
  Eigen::VectorXd last;
  const DiagnosisSystem system = linearise(model);
  for (const test::PoseSystem& pose : test::poses_of(system)) {
    const Measurement& m = model.runs[pose.run].measurements[pose.pose];
    if (m.kind != PoseKind::kinematic_pose || m.samples != 1) {
      last.resize(0);  // what follows is another stretch of motion
      continue;
    }
    const Eigen::MatrixXd by_pose = pose.by_pose;
    const Eigen::VectorXd residual = pose.residual;
    const Eigen::VectorXd rows = residual - by_pose * least_squares(by_pose, residual).x;
    if (last.size() > 0) {
      products += rows.dot(last);
      squares += 0.5 * (rows.squaredNorm() + last.squaredNorm());
    }
    last = rows;
  }
  return products / squares;
}

TEST_F(Motion, NoiseIsUncorrelatedAndASlowErrorIsNot) {
  EXPECT_EQ(motion_correlation(plain()), 0.0);  // nothing in motion
  const DiagnosisModel white = with_motion(plain(), {read()});
  EXPECT_NEAR(motion_correlation(white), correlation_of(white), 1e-9);
  EXPECT_LT(std::abs(motion_correlation(white)), 0.15);
  DiagnosisModel brief = white;  // rests of one sample are no motion, nor is a mean in motion one
  for (std::size_t i = 0; i < 4; ++i) brief.runs[0].measurements[i].samples = 1;
  const std::size_t rests = plain().runs[0].measurements.size();
  for (std::size_t i = rests + 5; i < brief.runs[0].measurements.size(); i += 10) {
    brief.runs[0].measurements[i].samples = 2;
    brief.runs[0].measurements[i].length_m.array() += 0.2;
  }
  EXPECT_NEAR(motion_correlation(brief), correlation_of(brief), 1e-9);
  Log wavy = read();
  for (Eigen::Index i = 0; i < wavy.sample_count(); ++i) {
    wavy.length_m(i, 1) += 0.05 * std::sin(0.5 * wavy.time_s[i]);
  }
  const DiagnosisModel slow = with_motion(plain(), {wavy});
  EXPECT_NEAR(motion_correlation(slow), correlation_of(slow), 1e-9);
  EXPECT_GT(motion_correlation(slow), 0.8);
}

TEST_F(Motion, ALateAttitudeIsNamedWithItsDelay) {
  const Log log = noisy(delayed(truth().log, 0.12), 0.05, 93);
  const Diagnosis d = diagnose(load_robot("irma4"), {log});
  EXPECT_EQ(d.verdict, Verdict::explained) << summary(d);
  ASSERT_EQ(d.effects.size(), 1U) << summary(d);
  EXPECT_EQ(d.effects[0].effect->name(), "sensor_delay");
  EXPECT_NEAR(d.effects[0].values[0], 0.12, 3.0 * d.effects[0].standard_deviation[0]);
  EXPECT_LT(d.effects[0].standard_deviation[0], 0.02);
  EXPECT_GT(d.model.pose_count(), d.baseline.pose_count());
  EXPECT_EQ(d.corrected.effects.back().name, "sensor_delay");
}

TEST_F(Motion, AnotherSensorThatIsLateIsNoLateAttitude) {
  for (const double delay_s : {0.12, 0.3, 0.6}) {
    const Log late = delayed(truth().log, delay_s, &Log::swivel_rad);
    const Diagnosis d = diagnose(load_robot("irma4"), {noisy(late, 0.05, 93)});
    for (const NamedEffect& found : d.effects) {
      EXPECT_EQ(found.effect->name(), "swivel_delay") << delay_s << summary(d);
    }
  }
}

TEST_F(Motion, ADelayThatIsRefusedLeavesTheModelAtRest) {
  std::vector<Log> logs{noisy(delayed(truth().log, 0.12), 0.05, 93)};
  std::vector<std::string> left_out;
  const DiagnosisModel at_rest = baseline_model(load_robot("irma4"), logs, left_out);
  const auto after = [&](DiagnoseOptions options, DiagnosisModel& model) {
    Diagnosis out;
    model = at_rest;
    Search(logs, model, out, options).in_motion();
    return out;
  };
  DiagnosisModel model;
  std::vector<std::string> steps;
  DiagnoseOptions options;
  options.progress = [&](const std::string& step) {
    steps.push_back(step);
    return true;
  };
  EXPECT_EQ(after(options, model).effects.size(), 1U);
  EXPECT_GT(model.pose_count(), at_rest.pose_count());
  EXPECT_EQ(steps, (std::vector<std::string>{"samples in motion", "accepted sensor_delay"}));

  DiagnoseOptions strict;
  strict.family_wise_p = 0.0;
  Diagnosis out = after(strict, model);
  EXPECT_TRUE(out.effects.empty());
  ASSERT_EQ(out.rejected.size(), 1U);
  EXPECT_EQ(out.rejected[0].name, "sensor_delay");
  EXPECT_EQ(out.rejected[0].reason.find("chance does as well"), 0U);
  EXPECT_EQ(model.pose_count(), at_rest.pose_count());
  EXPECT_TRUE(model.effects.empty());
  EXPECT_EQ(model.noise, at_rest.noise);

  DiagnoseOptions full;
  full.most_effects = 0;
  EXPECT_TRUE(after(full, model).identifiability.empty());  // not even looked at
}

TEST_F(Motion, WithoutADelayTheSamplesAreLookedAtAndLeftOut) {
  const Diagnosis d = diagnose(load_robot("irma4"), {read()});
  EXPECT_EQ(d.verdict, Verdict::consistent) << summary(d);
  EXPECT_EQ(d.model.pose_count(), d.baseline.pose_count());
  const auto delay =
      std::find_if(d.identifiability.begin(), d.identifiability.end(),
                   [](const Identifiability& i) { return i.name == "sensor_delay"; });
  ASSERT_NE(delay, d.identifiability.end());
  EXPECT_TRUE(delay->visible);
  EXPECT_GT(delay->detectable, 0.0);
  // Read too slowly to be followed, nothing is said about it.
  const Diagnosis slow = diagnose(load_robot("irma4"), {thinned(read(), 4)});
  for (const Identifiability& i : slow.identifiability) EXPECT_NE(i.name, "sensor_delay");
}

/// The swivels with play: each stands still until its cable has turned by the half-width beyond it.
Log with_play(Log log, double half_rad, LogMatrix& state) {
  const Robot robot = load_robot("irma4");
  state.resize(log.sample_count(), 4);
  CableVector lagging;
  for (Eigen::Index i = 0; i < log.sample_count(); ++i) {
    const PlatformState at = platform_state(robot, truth().poses[static_cast<std::size_t>(i)]);
    const CableVector swivel = at.swivel_rad();
    if (i == 0) lagging = swivel;
    for (int c = 0; c < 4; ++c) {
      lagging[c] = std::clamp(lagging[c], swivel[c] - half_rad, swivel[c] + half_rad);
      state(i, c) = (swivel[c] - lagging[c]) / half_rad;
      log.swivel_rad(i, c) -= half_rad * state(i, c);
    }
  }
  return log;
}

TEST_F(Motion, ThePlayOfTheSwivelsFollowsTheModelNotTheirReadings) {
  constexpr double kHalf_rad = 0.02;
  LogMatrix state;
  const Log log = noisy(with_play(truth().log, kHalf_rad, state), 0.05, 94);
  DiagnosisModel model = baseline_in_motion(log);
  model.effects.push_back({find_effect("swivel_hysteresis"), EffectValues::Zero(1)});
  ASSERT_TRUE(fit_with_noise(model));
  const auto off = [&](const DiagnosisModel& m) {
    double sum = 0.0;
    for (std::size_t i = 0; i < m.runs[0].rows.size(); ++i) {
      const SampleRange rows = m.runs[0].rows[i];
      const Eigen::RowVectorXd mean = state.middleRows(rows.begin, rows.size()).colwise().mean();
      sum += (m.runs[0].measurements[i].swivel_direction.transpose() - mean).squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(4 * m.runs[0].rows.size()));
  };
  const double before = off(model);
  DiagnosisModel refined = model;
  refine_swivel_play(refined, {log});
  EXPECT_LT(off(refined), 0.5 * before);
  EXPECT_LT(off(refined), 0.25);
  EXPECT_NEAR(refined.effects[0].values[0], kHalf_rad, 0.05 * kHalf_rad);
  EXPECT_LT(std::abs(refined.effects[0].values[0] - kHalf_rad),
            std::abs(model.effects[0].values[0] - kHalf_rad));
  EXPECT_LT(refined.noise[1], model.noise[1]);
  DiagnosisModel again = refined;  // there is nothing left to refine
  refine_swivel_play(again, {log});
  EXPECT_NEAR(again.effects[0].values[0], refined.effects[0].values[0], 0.01 * kHalf_rad);
  for (const Measurement& m : refined.runs[0].measurements) {
    EXPECT_EQ(m.swivel_direction_error, CableVector::Zero(4));
  }
}

TEST_F(Motion, ThePlayOfARestIsTheMeanOverItsSamplesOfAPlayThatFollowsSmoothedAngles) {
  constexpr double kHalf_rad = 0.02, kWindow_s = 1.0;
  LogMatrix state;
  const Log log = with_play(truth().log, kHalf_rad, state);
  DiagnosisModel model = exact();
  model.effects.push_back({find_effect("swivel_hysteresis"), EffectValues::Constant(1, kHalf_rad)});
  for (std::size_t i = 0; i < model.runs[0].measurements.size(); ++i) {
    const SampleRange rows = model.runs[0].rows[i];
    model.runs[0].measurements[i].swivel_rad =
        log.swivel_rad.middleRows(rows.begin, rows.size()).colwise().mean().transpose();
  }
  // Followed by lengths and attitude alone, which are exact.
  model.noise[static_cast<std::size_t>(in_motion(Channel::swivel))] = 1e3;
  ASSERT_TRUE(fit_with_noise(model));
  refine_swivel_play(model, {log});
  const double half_rad = std::abs(model.effects[0].values[0]);
  const Robot robot = load_robot("irma4");
  const Eigen::Index count = log.sample_count();
  LogMatrix swivel(count, 4), expected(count, 4);
  for (Eigen::Index i = 0; i < count; ++i) {
    swivel.row(i) =
        platform_state(robot, truth().poses[static_cast<std::size_t>(i)]).swivel_rad().transpose();
  }
  for (int c = 0; c < 4; ++c) {
    double lagging = swivel(0, c);
    for (Eigen::Index i = 0; i < count; ++i) {
      double sum = 0.0, inside = 0.0;
      for (Eigen::Index j = 0; j < count; ++j) {
        if (std::abs(log.time_s[j] - log.time_s[i]) > 0.5 * kWindow_s + 1e-9) continue;
        sum += swivel(j, c), inside += 1.0;
      }
      lagging = std::clamp(lagging, sum / inside - half_rad, sum / inside + half_rad);
      expected(i, c) = (sum / inside - lagging) / half_rad;
    }
  }
  for (std::size_t i = 0; i < model.runs[0].rows.size(); ++i) {
    const SampleRange rows = model.runs[0].rows[i];
    const Eigen::RowVectorXd mean = expected.middleRows(rows.begin, rows.size()).colwise().mean();
    for (int c = 0; c < 4; ++c) {
      EXPECT_NEAR(model.runs[0].measurements[i].swivel_direction[c], mean[c], 0.03) << i;
    }
  }
}

TEST_F(Motion, WithoutPlayNothingIsRefined) {
  const auto unchanged = [&](const DiagnosisModel& before) {
    DiagnosisModel after = before;
    refine_swivel_play(after, {read()});
    for (std::size_t i = 0; i < before.runs[0].poses.size(); ++i) {
      EXPECT_EQ(after.runs[0].poses[i].position_m, before.runs[0].poses[i].position_m);
      EXPECT_EQ(after.runs[0].measurements[i].swivel_direction,
                before.runs[0].measurements[i].swivel_direction);
    }
    EXPECT_EQ(after.noise, before.noise);
  };
  unchanged(plain());
  DiagnosisModel none = plain();
  none.effects.push_back({find_effect("swivel_hysteresis"), EffectValues::Zero(1)});
  unchanged(none);
}

TEST_F(Motion, SwivelHysteresisIsNamedFromAWholeRun) {
  LogMatrix state;
  const Log log = noisy(with_play(truth().log, 0.015, state), 0.05, 95);
  const Diagnosis d = diagnose(load_robot("irma4"), {log});
  ASSERT_EQ(d.effects.size(), 1U) << summary(d);
  EXPECT_EQ(d.effects[0].effect->name(), "swivel_hysteresis");
  EXPECT_NEAR(d.effects[0].values[0], 0.015,
              std::max(3.0 * d.effects[0].standard_deviation[0], 0.05 * 0.015));
  const double deviation = test::deviation_with_directions(d.model)[0];
  EXPECT_NEAR(d.effects[0].standard_deviation[0], deviation, 1e-3 * deviation);
  // The directions are those of the model along the whole run, and no estimates of the readings'.
  double guessed = 0.0;
  for (const Measurement& m : d.baseline.runs[0].measurements) {
    guessed += m.swivel_direction_error.norm();
  }
  EXPECT_GT(guessed, 0.0);
  for (const Measurement& m : d.model.runs[0].measurements) {
    EXPECT_EQ(m.swivel_direction_error.norm(), 0.0);
  }
}

}  // namespace
}  // namespace cdprcal
