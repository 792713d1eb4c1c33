#include "cdprcal/diagnosis/diagnose.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <regex>

#include "../support/dense.hpp"
#include "../support/run.hpp"
#include "cdprcal/calibration/calibrate.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/evidence/checks.hpp"
#include "cdprcal/evidence/model_average.hpp"

namespace cdprcal {
namespace {

using test::startup_log;
using test::summary;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double kNoise = 0.2;  // a sample; a dwell's mean is quieter

struct OneEffect {
  std::string name;
  std::vector<double> truth;
  std::function<void(Log&)> spoil;     ///< what it does to the readings,
  std::function<void(Robot&)> change;  ///< or to the robot that makes them
};

std::vector<OneEffect> single_effects() {
  const auto columns = [](LogMatrix Log::* group, std::vector<double> values, bool scales) {
    return [=](Log& log) {
      for (Eigen::Index i = 0; i < (log.*group).cols(); ++i) {
        const double v = values[static_cast<std::size_t>(i)];
        if (scales)
          (log.*group).col(i) *= 1.0 + v;
        else
          (log.*group).col(i).array() += v;
      }
    };
  };
  return {
      {"load_cell_bias", {9, -7, 11, -8}, columns(&Log::tension_N, {9, -7, 11, -8}, false), {}},
      {"transmission_ratio",
       {0.02, -0.015, 0.025, 0.012},
       columns(&Log::length_m, {0.02, -0.015, 0.025, 0.012}, true),
       {}},
      {"load_cell_gain",
       {0.09, -0.08, 0.07, -0.1},
       columns(&Log::tension_N, {0.09, -0.08, 0.07, -0.1}, true),
       {}},
      {"yaw_drift",
       {0.0004},
       [](Log& log) { log.roll_pitch_yaw_rad.col(2) += 0.0004 * log.time_s; },
       {}},
      {"centre_of_mass",
       {0.012, -0.015, 0.0},
       {},
       [](Robot& robot) { robot.platform.centre_of_mass_m += Vector3(0.012, -0.015, 0.0); }},
  };
}

Log log_with(const OneEffect& effect, std::uint64_t seed) {
  Robot robot = load_robot("irma4");
  if (effect.change) effect.change(robot);
  Log log = startup_log(robot, kNoise, seed);
  if (effect.spoil) effect.spoil(log);
  return log;
}

TEST(Diagnose, CleanLogsAreConsistentAndThePoseStays) {
  const Robot robot = load_robot("irma4");
  for (const std::uint64_t seed : {11, 12, 13}) {
    const Diagnosis d = diagnose(robot, {startup_log(robot, kNoise, seed)});
    EXPECT_EQ(d.verdict, Verdict::consistent) << summary(d);
    EXPECT_EQ(d.initial_pose_before.position_m, d.initial_pose_after.position_m);
    // One pose and one σ, whichever command a person asks.
    const CalibrationResult result = calibrate(robot, startup_log(robot, kNoise, seed)).result;
    EXPECT_EQ(d.initial_pose_after.position_m, result.poses.front().position_m);
    EXPECT_EQ(d.covariance_before, result.covariance);
    EXPECT_EQ(d.covariance_after, result.covariance);
    EXPECT_TRUE(d.corrected.effects.empty());
    EXPECT_TRUE(d.next.empty());
    EXPECT_FALSE(d.gap.empty());
  }
}

class OneEffectTest : public testing::TestWithParam<OneEffect> {};

TEST_P(OneEffectTest, IsNamedMeasuredAndCorrected) {
  const OneEffect& effect = GetParam();
  const Robot robot = load_robot("irma4");
  const Log log = log_with(effect, 21);
  const Diagnosis d = diagnose(robot, {log});
  ASSERT_EQ(d.verdict, Verdict::explained) << summary(d);
  ASSERT_EQ(d.effects.size(), 1U) << summary(d);
  const NamedEffect& found = d.effects.front();
  EXPECT_EQ(found.effect->name(), effect.name) << summary(d);
  ASSERT_EQ(found.values.size(), static_cast<Eigen::Index>(effect.truth.size()));
  for (Eigen::Index i = 0; i < found.values.size(); ++i) {
    EXPECT_NEAR(found.values[i], effect.truth[static_cast<std::size_t>(i)],
                3.0 * found.standard_deviation[i])
        << i;
  }
  EXPECT_LT(found.p_value, 0.01);
  EXPECT_GT(found.log_evidence, 3.0);
  EXPECT_LT(found.held_out_after, found.held_out_before);
  EXPECT_EQ(d.next.empty(), found.rivals.empty());

  // The corrected file explains the same log, and another one of the same robot.
  const Robot corrected = parse_robot(to_yaml(d.corrected), "corrected");
  for (const Log& again : {log, log_with(effect, 22)}) {
    const Diagnosis second = diagnose(corrected, {again});
    EXPECT_EQ(second.verdict, Verdict::consistent) << summary(second);
  }
}

TEST(Diagnose, DrumsOfOneMakeAreNoFrameOfAnotherSize) {
  // All winches off by one share looks like a smaller frame, which has one number for it.
  const Robot robot = load_robot("irma4");
  for (const double share : {-0.008, 0.01}) {
    Log log = startup_log(robot, kNoise, 23);
    log.length_m *= 1.0 + share;
    const Diagnosis d = diagnose(robot, {log});
    ASSERT_EQ(d.verdict, Verdict::explained) << summary(d);
    ASSERT_EQ(d.effects.size(), 1U) << summary(d);
    EXPECT_EQ(d.effects[0].effect->name(), "transmission_ratio") << summary(d);
    EXPECT_NEAR(d.effects[0].values.mean(), share, 0.002);
  }
  Robot larger = robot;
  for (Cable& cable : larger.cables) cable.pulley.position_m *= 1.004;
  const Diagnosis d = diagnose(robot, {startup_log(larger, kNoise, 24)});
  ASSERT_EQ(d.effects.size(), 1U) << summary(d);
  EXPECT_EQ(d.effects[0].effect->name(), "frame_scale") << summary(d);
}

INSTANTIATE_TEST_SUITE_P(Catalogue, OneEffectTest, testing::ValuesIn(single_effects()),
                         [](const auto& one) { return one.param.name; });

struct OneFault {
  std::string name;
  std::vector<double> values;
  std::function<void(Log&)> spoil;
};

class OneFaultTest : public testing::TestWithParam<OneFault> {};

TEST_P(OneFaultTest, IsFoundAndCorrected) {
  const Robot robot = load_robot("irma4");
  Log log = startup_log(robot, kNoise, 31, 0);  // few poses: a fault is gross
  GetParam().spoil(log);
  const Diagnosis d = diagnose(robot, {log});
  EXPECT_EQ(d.verdict, Verdict::explained) << summary(d);
  ASSERT_EQ(d.faults.size(), 1U) << summary(d);
  EXPECT_EQ(d.faults[0].name, GetParam().name);
  EXPECT_EQ(d.faults[0].values, GetParam().values);
  EXPECT_TRUE(d.effects.empty()) << summary(d);
  const Diagnosis second = diagnose(parse_robot(to_yaml(d.corrected), "corrected"), {log});
  EXPECT_EQ(second.verdict, Verdict::consistent) << summary(second);
}

INSTANTIATE_TEST_SUITE_P(
    Configuration, OneFaultTest,
    testing::Values(
        OneFault{"length_sign", {1, -1, 1, 1}, [](Log& log) { log.length_m.col(1) *= -1.0; }},
        OneFault{
            "swivel_sign", {1, 1, -1, -1}, [](Log& log) { log.swivel_rad.rightCols<2>() *= -1.0; }},
        OneFault{"cable_order",
                 {3, 2, 1, 4},
                 [](Log& log) {
                   for (LogMatrix* m :
                        {&log.length_m, &log.swivel_rad, &log.tension_N, &log.tension_setpoint_N}) {
                     if (m->cols() > 0) m->col(0).swap(m->col(2));
                   }
                 }},
        OneFault{"length_unit", {1e-3}, [](Log& log) { log.length_m *= 1e3; }},
        OneFault{
            "angle_unit", {1.0, kDegree}, [](Log& log) { log.roll_pitch_yaw_rad /= kDegree; }}),
    [](const auto& one) { return one.param.name; });

TEST(Diagnose, EncodersInAnotherOrderThanTheLoadCells) {
  const Robot robot = load_robot("irma4");
  Log log = startup_log(robot, kNoise, 42, 0);
  // Channel i reads the encoders of cable order[i]: a cycle, so that the way back is another one.
  for (LogMatrix* m : {&log.length_m, &log.swivel_rad}) {
    const LogMatrix read = *m;
    m->col(0) = read.col(3);
    m->rightCols<3>() = read.leftCols<3>();
  }
  const Diagnosis d = diagnose(robot, {log});
  ASSERT_EQ(d.faults.size(), 1U) << summary(d);
  EXPECT_EQ(d.faults[0].name, "cable_order");
  EXPECT_EQ(d.faults[0].values, (std::vector<double>{2, 3, 4, 1}));
  EXPECT_EQ(d.faults[0].tension_order, (std::vector<double>{1, 2, 3, 4}));
  const Diagnosis second = diagnose(parse_robot(to_yaml(d.corrected), "corrected"), {log});
  EXPECT_EQ(second.verdict, Verdict::consistent) << summary(second);
}

TEST(Diagnose, ALogThatContradictsTheRobotIsNeverConsistent) {
  // A swivel that reads another run's: no fault that is tried sets it right.
  const Robot robot = load_robot("irma4");
  Log log = startup_log(robot, kNoise, 43, 0);
  log.swivel_rad.col(0).reverseInPlace();
  const Diagnosis d = diagnose(robot, {log});
  EXPECT_EQ(d.verdict, Verdict::unexplained) << summary(d);
  ASSERT_FALSE(d.unexplained.empty());
  const SensorSigma& s = robot.sigma;
  for (const Unexplained& left : d.unexplained) {
    if (left.depends_on != "nothing that was tried") continue;
    EXPECT_GT(left.rms, 3.0 * left.sigma);
    EXPECT_EQ(left.sigma, left.channel == "length"    ? s.length_m
                          : left.channel == "swivel"  ? s.swivel_rad
                          : left.channel == "tension" ? s.tension_N
                                                      : s.attitude_rad);
  }
}

TEST(Diagnose, WhatIsBeyondThreeSigmaIsNotConsistent) {
  // Readings that differ from rest to rest by so many sigma, each its own way: no effect does that.
  const Robot robot = load_robot("irma4");
  struct Case {
    const char* channel;
    LogMatrix Log::* readings;
    double sigma;
    NoiseGroup group;
    double sigmas;
  };
  for (const Case& c :
       {Case{"length", &Log::length_m, robot.sigma.length_m, at_rest(Channel::length), 2.4},
        Case{"length", &Log::length_m, robot.sigma.length_m, at_rest(Channel::length), 3.75},
        Case{"tension", &Log::tension_N, robot.sigma.tension_N, at_rest(Channel::balance), 2.0},
        Case{"tension", &Log::tension_N, robot.sigma.tension_N, at_rest(Channel::balance), 5.0}}) {
    Log log = startup_log(robot, kNoise, 46);
    RandomNormal random(47);
    Eigen::RowVector4d off = Eigen::RowVector4d::Zero();
    for (Eigen::Index i = 0; i < log.sample_count(); ++i) {
      if (i % 80 == 60) {  // in the middle of each move
        for (double& v : off) v = c.sigmas * c.sigma * random();
      }
      (log.*c.readings).row(i) += off;
    }
    const Diagnosis d = diagnose(robot, {log});
    SCOPED_TRACE(std::string(c.channel) + " " + std::to_string(c.sigmas) + " " + summary(d));
    const auto found = std::find_if(d.unexplained.begin(), d.unexplained.end(), [&](const auto& u) {
      return u.channel == c.channel && u.depends_on == "nothing that was tried";
    });
    EXPECT_EQ(found != d.unexplained.end(), c.sigmas > 3.0);
    EXPECT_EQ(d.verdict == Verdict::unexplained, c.sigmas > 3.0);
    if (found == d.unexplained.end()) continue;
    EXPECT_EQ(found->sigma, c.sigma);
    const double unit = c.group == at_rest(Channel::balance) ? c.sigma : 1.0;
    EXPECT_EQ(found->rms, unit * d.model.noise[static_cast<std::size_t>(c.group)]);
    EXPECT_THAT(d.next,
                Contains("the readings contradict the sigma of the robot file: check signs, "
                         "scales and order of the sensors, and whether the log is this "
                         "robot's"));
  }
}

TEST(Diagnose, OneLogOfSeveralThatContradictsTheRobotIsNotConsistent) {
  const Robot robot = load_robot("irma4");
  const std::vector<std::function<void(Log&)>> spoil{
      [](Log& log) { log.length_m *= 1e3; },
      [](Log& log) { log.swivel_rad *= -1.0; },
      [](Log& log) { log.length_m.col(0).swap(log.length_m.col(2)); },
  };
  for (const auto& change : spoil) {
    std::vector<Log> logs{startup_log(robot, kNoise, 31, 0), startup_log(robot, kNoise, 32, 0)};
    change(logs[1]);
    const Diagnosis d = diagnose(robot, logs);
    EXPECT_EQ(d.verdict, Verdict::unexplained) << summary(d);
    EXPECT_THAT(d.next, Contains(HasSubstr("diagnose each log by itself")));
  }
}

TEST(Diagnose, AFaultOfTheRobotsFileIsSetRightInEveryLog) {
  const Robot robot = load_robot("irma4");
  std::vector<Log> logs{startup_log(robot, kNoise, 31, 0), startup_log(robot, kNoise, 32, 0)};
  for (Log& log : logs) log.length_m *= 1e3;
  const Diagnosis d = diagnose(robot, logs);
  EXPECT_EQ(d.verdict, Verdict::explained) << summary(d);
  ASSERT_EQ(d.faults.size(), 1U) << summary(d);
  EXPECT_EQ(d.faults[0].name, "length_unit");
  EXPECT_TRUE(d.effects.empty()) << summary(d);
}

TEST(Diagnose, SeveralLogsShareTheRobotsEffectsAndKeepTheRunsOwn) {
  const Robot robot = load_robot("irma4");
  std::vector<Log> logs;
  const std::vector<double> rates{0.0006, -0.0004};
  for (std::size_t k = 0; k < rates.size(); ++k) {
    Log log = startup_log(robot, kNoise, 41 + k);
    log.roll_pitch_yaw_rad.col(2) += rates[k] * log.time_s;
    log.tension_N.rowwise() += Eigen::RowVector4d(10, -8, 9, -12);
    logs.push_back(std::move(log));
  }
  const Diagnosis d = diagnose(robot, logs);
  ASSERT_EQ(d.effects.size(), 2U) << summary(d);
  for (const NamedEffect& effect : d.effects) {
    if (effect.effect->name() != "yaw_drift") {
      EXPECT_EQ(effect.effect->name(), "load_cell_bias");
      EXPECT_EQ(effect.values.size(), 4);
      continue;
    }
    ASSERT_EQ(effect.values.size(), 2);
    for (int k = 0; k < 2; ++k) {
      EXPECT_NEAR(effect.values[k], rates[static_cast<std::size_t>(k)],
                  3.0 * effect.standard_deviation[k]);
    }
  }
  ASSERT_EQ(d.corrected.effects.size(), 3U);
  const Robot corrected = parse_robot(to_yaml(d.corrected), "corrected");
  for (const std::vector<Log>& again : {logs, {logs[0]}, {logs[1]}}) {
    const Diagnosis second = diagnose(corrected, again);
    EXPECT_EQ(second.verdict, Verdict::consistent) << summary(second);
  }
}

TEST(Diagnose, ErrorsThatStayOverARestAreNoFindingAndNotPassedOver) {
  const Robot robot = load_robot("irma4");
  Log log = startup_log(robot, 0.01, 77, 0);
  RandomNormal random(5);
  const auto rests = calibrate(robot, log).equilibria;
  ASSERT_GT(rests.size(), 5U);
  const auto spoil = [&](LogMatrix& readings, double sigma) {
    Eigen::Index begin = 0;
    for (std::size_t i = 0; i < rests.size(); ++i) {
      // Up to halfway to the next rest, so that no sample of any is left out.
      const Eigen::Index end = i + 1 < rests.size()
                                   ? (rests[i].samples.end + rests[i + 1].samples.begin) / 2
                                   : log.sample_count();
      for (Eigen::Index c = 0; c < readings.cols(); ++c) {
        readings.col(c).segment(begin, end - begin).array() += sigma * random();
      }
      begin = end;
    }
  };
  spoil(log.length_m, 0.3 * robot.sigma.length_m);
  spoil(log.swivel_rad, 0.3 * robot.sigma.swivel_rad);
  spoil(log.tension_N, 0.3 * robot.sigma.tension_N);
  spoil(log.roll_pitch_yaw_rad, 0.3 * robot.sigma.attitude_rad);
  const Diagnosis d = diagnose(robot, {log});
  EXPECT_EQ(d.verdict, Verdict::consistent) << summary(d);
  EXPECT_THAT(d.next, Contains(HasSubstr("errors that stay over a rest count as noise (the model "
                                         "misfits lengths by")));
}

/// Effects that the robot of the last of three logs has, and that of the others has not.
class ChangedRobotTest : public testing::TestWithParam<OneEffect> {};

TEST_P(ChangedRobotTest, IsNamedWithWhatEachLogHas) {
  const OneEffect& effect = GetParam();
  const Robot robot = load_robot("irma4");
  const std::vector<Log> logs{startup_log(robot, kNoise, 51), startup_log(robot, kNoise, 52),
                              log_with(effect, 53)};
  const Diagnosis d = diagnose(robot, logs);
  EXPECT_EQ(d.verdict, Verdict::explained) << summary(d);
  ASSERT_EQ(d.effects.size(), 1U) << summary(d);
  const NamedEffect& found = d.effects[0];
  EXPECT_EQ(found.effect->name(), effect.name);
  EXPECT_EQ(found.effect->info().scope, EffectScope::run);
  const auto size = static_cast<Eigen::Index>(effect.truth.size());
  ASSERT_EQ(found.values.size(), 3 * size);
  for (Eigen::Index i = 0; i < 3 * size; ++i) {
    const double truth = i < 2 * size ? 0.0 : effect.truth[static_cast<std::size_t>(i % size)];
    EXPECT_NEAR(found.values[i], truth, 4.0 * found.standard_deviation[i]) << i;
  }
  EXPECT_THAT(d.next, Contains(HasSubstr(effect.name + " is not the same in all logs")));
  // It is no rival of the same in all logs.
  for (const std::string& rival : found.rivals) EXPECT_NE(rival, effect.name);
  // The corrected file says which log has which values, and each log is set right by it.
  const Robot corrected = parse_robot(to_yaml(d.corrected), "corrected");
  ASSERT_EQ(corrected.effects.size(), 3U);
  for (std::size_t i = 0; i < logs.size(); ++i) {
    EXPECT_FALSE(corrected.effects[i].run.empty());
    EXPECT_EQ(diagnose(corrected, {logs[i]}).verdict, Verdict::consistent);
  }
}

INSTANTIATE_TEST_SUITE_P(Catalogue, ChangedRobotTest,
                         testing::Values(single_effects()[0], single_effects()[1],
                                         single_effects()[4]),
                         [](const auto& info) { return info.param.name; });

TEST(Diagnose, WhatAllLogsHaveIsTheRobotsOwn) {
  const OneEffect effect = single_effects()[0];
  std::vector<Log> logs;
  for (const std::uint64_t seed : {61, 62, 63}) logs.push_back(log_with(effect, seed));
  const Diagnosis d = diagnose(load_robot("irma4"), logs);
  ASSERT_EQ(d.effects.size(), 1U) << summary(d);
  EXPECT_EQ(d.effects[0].effect->name(), effect.name);
  EXPECT_EQ(d.effects[0].effect->info().scope, EffectScope::robot);
}

TEST(Diagnose, CanBeStoppedAndKeepsItsFindings) {
  const Robot robot = load_robot("irma4");
  Log log = startup_log(robot, kNoise, 51);
  log.tension_N.rowwise() += Eigen::RowVector4d(10, -8, 9, -12);
  std::vector<std::string> steps;
  DiagnoseOptions options;
  options.progress = [&](const std::string& step) {
    steps.push_back(step);
    return step != "scan after 1 effects";
  };
  const Diagnosis d = diagnose(robot, {log}, options);
  EXPECT_EQ(d.effects.size(), 1U);
  EXPECT_EQ(steps, (std::vector<std::string>{"discrete faults: signs, order, units, conventions",
                                             "baseline", "scan after 0 effects",
                                             "accepted load_cell_bias", "scan after 1 effects"}));
  EXPECT_EQ(d.verdict, Verdict::undetermined);
  EXPECT_EQ(d.reason, "stopped before the search was over: what was found so far stands");
}

TEST(Diagnose, StoppedBeforeItSearchedItClaimsNothing) {
  DiagnoseOptions options;
  options.progress = [](const std::string&) { return false; };
  for (const Log& log : {startup_log(load_robot("irma4"), kNoise, 51), test::log_with_bump()}) {
    const Diagnosis d = diagnose(load_robot("irma4"), {log}, options);
    EXPECT_EQ(d.verdict, Verdict::undetermined) << d.reason;
  }
}

TEST(Diagnose, FitsTheEffectsThatAreChosenAndNoOthers) {
  const Robot robot = load_robot("irma4");
  Log log = startup_log(robot, kNoise, 51);
  log.tension_N.rowwise() += Eigen::RowVector4d(10, -8, 9, -12);
  const auto with = [&](std::vector<std::string> names) {
    DiagnoseOptions options;
    options.effects = std::move(names);
    return diagnose(robot, {log}, options);
  };
  const Diagnosis found = diagnose(robot, {log});
  const Diagnosis same = with({"load_cell_bias"});
  ASSERT_EQ(found.effects.size(), 1U);
  ASSERT_EQ(same.effects.size(), 1U);
  const NamedEffect& a = found.effects[0];
  const NamedEffect& b = same.effects[0];
  const Eigen::VectorXd off = (a.values - b.values).cwiseQuotient(a.standard_deviation);
  EXPECT_LT(off.cwiseAbs().maxCoeff(), 0.01);  // both begin elsewhere, and settle at the same
  EXPECT_NEAR(b.log_evidence, a.log_evidence, 0.1);
  EXPECT_EQ(same.verdict, Verdict::undetermined);
  EXPECT_EQ(same.corrected.effects.size(), 1U);

  const Diagnosis none = with({});
  EXPECT_TRUE(none.effects.empty());
  EXPECT_EQ(none.initial_pose_after.position_m, none.initial_pose_before.position_m);
  const Diagnosis two = with({"yaw_drift", "load_cell_bias"});
  ASSERT_EQ(two.effects.size(), 2U);
  EXPECT_EQ(two.effects[0].effect->name(), "yaw_drift");
  EXPECT_THROW(with({"nonsense"}), InputError);
  EXPECT_THROW(with({"mass", "mass"}), InputError);
  EXPECT_THROW(with({"sensor_delay"}), InputError);
}

TEST(Diagnose, TheInitialPosesCovarianceIsItsBlockOfTheWhole) {
  const DiagnosisModel& model = test::two_runs();
  const Eigen::MatrixXd whole = test::dense(linearise(model)).covariance();
  for (const std::size_t run : {0U, 1U}) {
    const auto begin = 6 * static_cast<Eigen::Index>(run * model.runs[0].poses.size());
    const Matrix6 expected = whole.block<6, 6>(begin, begin);
    const Matrix6 found = initial_pose_covariance(model, run);
    const Vector6 unit = expected.diagonal().cwiseSqrt().cwiseInverse();
    const Matrix6 off = unit.asDiagonal() * (found - expected) * unit.asDiagonal();
    EXPECT_LE(off.norm(), 1e-5);
  }
  EXPECT_TRUE(initial_pose_covariance(model, 2).array().isNaN().all());  // no such run
}

TEST(Diagnose, PriorsAndDeviationsAreThoseOfTheModelThatItReturns) {
  const std::vector<Log> logs = test::two_logs();
  const Diagnosis d = diagnose(load_robot("irma4"), logs);
  ASSERT_EQ(d.effects.size(), 2U) << summary(d);
  const Eigen::MatrixXd covariance =
      test::dense(linearise(with_uncertain_noise(d.model))).covariance();
  const auto common = d.model.effects[0].values.size() + d.model.effects[1].values.size();
  const Eigen::VectorXd variance = covariance.diagonal().tail(common);
  Eigen::Index at = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    const EffectTerm& term = d.model.effects[k];
    const double typical = term.effect->typical(load_robot("irma4"))[0];
    double squares = 2.0;  // two values of the size that is typical
    for (Eigen::Index j = 0; j < term.values.size(); ++j, ++at) {
      EXPECT_EQ(d.effects[k].values[j], term.values[j]);
      // Nothing hangs on directions here.
      EXPECT_NEAR(d.effects[k].standard_deviation[j], std::sqrt(variance[at]),
                  0.02 * std::sqrt(variance[at]));
      squares += (term.values[j] * term.values[j] + variance[at]) / (typical * typical);
    }
    EXPECT_NEAR(term.prior_scale,
                std::sqrt(squares / (2.0 + static_cast<double>(term.values.size()))),
                0.02 * term.prior_scale);
  }
}

TEST(Diagnose, DeviationsCountWhatDirectionsOfMotionMayBeOff) {
  const Robot robot = load_robot("irma4");
  const Log clean = startup_log(robot, kNoise, 48);
  const PathState path = path_state(load_robot("irma4"), clean);
  Log rubbing = clean;
  rubbing.tension_N.array() *= (-0.06 * path.length_direction.array()).exp();
  const Diagnosis d = diagnose(robot, {rubbing});
  ASSERT_EQ(d.effects.size(), 1U) << summary(d);
  ASSERT_EQ(d.effects[0].effect->name(), "pulley_friction");
  const double expected = test::deviation_with_directions(d.model)[0];
  // What was not found adds little here: this log speaks against it.
  const auto scores = scan(d.model, untried(d.model), {.draws = 0, .limits = true});
  const double unseen = std::sqrt(unseen_effects(d.model, scores).of_values[0]);
  EXPECT_LT(unseen, 0.1 * expected);
  EXPECT_NEAR(d.effects[0].standard_deviation[0], std::hypot(expected, unseen), 1e-3 * expected);
  const Eigen::MatrixXd of_the_fit = test::dense(linearise(d.model)).covariance();
  EXPECT_GT(expected, 1.5 * std::sqrt(of_the_fit(Eigen::last, Eigen::last)));
}

TEST(Diagnose, SaysWhatThisLogCouldSeeOfEachEffect) {
  const Robot robot = load_robot("irma4");
  Log log = startup_log(robot, kNoise, 44);
  log.tension_N.rowwise() += Eigen::RowVector4d(10, -8, 9, -12);
  const Diagnosis d = diagnose(robot, {log});
  ASSERT_EQ(d.effects.size(), 1U) << summary(d);
  std::size_t at_rest = 0;
  for (const auto& effect : effect_catalogue()) at_rest += effect->needs_motion() ? 0U : 1U;
  EXPECT_EQ(d.ranking.size(), at_rest);
  EXPECT_EQ(d.ranking.front().effect->name(), "load_cell_bias");
  for (std::size_t i = 1; i < d.ranking.size(); ++i) {
    EXPECT_LE(d.ranking[i].log_evidence, d.ranking[i - 1].log_evidence);
    EXPECT_FALSE(d.ranking[i].effect->needs_motion());
  }
  // Those that show in samples of motion are looked for there, and are told as well.
  const auto in_motion = std::ranges::count(effect_catalogue(), Shows::in_motion,
                                            [](const auto& effect) { return effect->shows(); });
  EXPECT_EQ(d.identifiability.size(), at_rest + static_cast<std::size_t>(in_motion));
  for (const Identifiability& seen : d.identifiability) {
    if (seen.name == "load_cell_bias") {
      EXPECT_TRUE(seen.visible);
      EXPECT_TRUE(std::isnan(seen.detectable_after));  // it is in the model
    } else if (seen.name == "load_cell_gain") {
      // The bias was noise to it before; and the bias takes part of what a gain does.
      EXPECT_GT(seen.detectable, 0.0);
      EXPECT_TRUE(std::isfinite(seen.detectable_after));
    }
  }
  // Wider than the fit's own: the noise is estimated, and not all can be seen.
  const auto wider = [](const Matrix6& told, const Matrix6& of_fit) {
    return SymmetricEigen<Matrix6>(told - of_fit).eigenvalues().minCoeff() >= -1e-9 * told.norm();
  };
  EXPECT_TRUE(wider(d.covariance_before, initial_pose_covariance(d.baseline, 0)));
  EXPECT_TRUE(wider(d.covariance_after, initial_pose_covariance(d.model, 0)));
  EXPECT_EQ(d.initial_pose_before.position_m, d.baseline.runs[0].poses[0].position_m);
  EXPECT_EQ(d.initial_pose_after.position_m, d.model.runs[0].poses[0].position_m);
  EXPECT_NE(d.initial_pose_after.position_m, d.initial_pose_before.position_m);
  EXPECT_EQ(d.gap.front().after_effect, "");
  EXPECT_EQ(d.gap.back().after_effect, "load_cell_bias");
}

TEST(Diagnose, WhatNoNameExplainsIsDescribed) {
  const Robot robot = load_robot("irma4");
  Log log = startup_log(robot, 0.1, 75);
  log.tension_N.array() += 8e-4 * log.tension_N.array().square();
  const Diagnosis d = diagnose(robot, {log});
  EXPECT_EQ(d.verdict, Verdict::described) << summary(d);
  EXPECT_EQ(d.reason,
            "a formula describes what the named effects do not explain: look for its cause");
  EXPECT_TRUE(d.unexplained.empty());
  ASSERT_FALSE(d.effects.empty());
  EXPECT_TRUE(d.effects.front().described);
  EXPECT_TRUE(d.effects.front().effect->name().starts_with("tension_by_tension")) << summary(d);
  ASSERT_FALSE(d.corrected.own_effects.empty());
  EXPECT_EQ(d.corrected.own_effects.front()->name(), d.effects.front().effect->name());
  // Another law is as likely, and knows no more of the pose than the model did without it.
  for (int axis = 0; axis < 6; ++axis) {
    EXPECT_GT(d.covariance_after(axis, axis), 0.4 * d.covariance_before(axis, axis)) << axis;
  }
  EXPECT_EQ(diagnose(d.corrected, {log}).verdict, Verdict::consistent);
}

/// What hops with the least change of the set-points: no law that anybody could find.
LogMatrix hops(const Log& log) { return (1e3 * log.tension_setpoint_N.array().round()).sin(); }

TEST(Diagnose, WhatNothingExplainsIsReportedInTheChannelsUnit) {
  Robot robot = load_robot("irma4");
  Log log = startup_log(robot, 0.01, 75);
  robot.sigma.tension_N = 1.0;
  log.tension_N += 8.0 * hops(log);
  const Diagnosis d = diagnose(robot, {log});
  EXPECT_EQ(d.verdict, Verdict::unexplained) << summary(d);
  EXPECT_EQ(d.reason, "something is left that no effect of the catalogue explains");
  ASSERT_EQ(d.unexplained.size(), 1U);
  const Unexplained& left = d.unexplained[0];
  EXPECT_EQ(left.channel, "tension");
  // Of the balance's rows, in the load cells' newtons.
  EXPECT_EQ(left.rms, robot.sigma.tension_N * d.model.noise[4]);
  EXPECT_GT(left.rms, left.sigma);
  ASSERT_FALSE(d.next.empty());
}

TEST(Diagnose, WhatIsLeftOfAnAngleIsInRadians) {
  Robot robot = load_robot("irma4");
  Log log = startup_log(robot, 0.01, 75);
  robot.sigma.attitude_rad = 0.002;
  log.roll_pitch_yaw_rad.col(2) += 0.05 * hops(log).col(1);
  const Diagnosis d = diagnose(robot, {log});
  ASSERT_EQ(d.unexplained.size(), 1U) << summary(d);
  EXPECT_EQ(d.unexplained[0].channel, "yaw");
  EXPECT_EQ(d.unexplained[0].rms, d.model.noise[3]);
}

TEST(Diagnose, WhatIsLeftOfTheLengthsIsInMetres) {
  Robot robot = load_robot("irma4");
  Log log = startup_log(robot, 0.01, 75);
  robot.sigma.length_m = 1e-3;
  log.length_m += 0.012 * hops(log);
  const Diagnosis d = diagnose(robot, {log});
  ASSERT_EQ(d.unexplained.size(), 1U) << summary(d);
  EXPECT_EQ(d.unexplained[0].channel, "length");
  EXPECT_EQ(d.unexplained[0].rms, d.model.noise[0]);
}

TEST(Diagnose, ACourseOverTheRunIsDescribedAsOne) {
  Log log = startup_log(load_robot("irma4"), 0.1, 75);
  const double middle_s = 0.5 * log.time_s[log.sample_count() - 1];
  log.length_m.colwise() += (0.02 * (log.time_s.array() / middle_s - 1.0).square()).matrix();
  const Diagnosis d = diagnose(load_robot("irma4"), {log});
  EXPECT_EQ(d.verdict, Verdict::described) << summary(d);
  ASSERT_EQ(d.effects.size(), 1U) << summary(d);
  EXPECT_TRUE(d.effects[0].effect->name().starts_with("length_by_time")) << summary(d);
}

TEST(Diagnose, EffectsThatCannotBeToldApartComeWithPosesThatWould) {
  const Robot robot = load_robot("irma4");
  Robot moved = robot;
  for (Cable& cable : moved.cables) cable.platform_anchor_m.x() += 0.003;
  const Diagnosis d = diagnose(robot, {startup_log(moved, 0.1, 76, 3)});
  ASSERT_EQ(d.effects.size(), 1U) << summary(d);
  const NamedEffect& effect = d.effects[0];
  ASSERT_FALSE(effect.rivals.empty());
  std::string rivals;
  for (const std::string& rival : effect.rivals) rivals += (rivals.empty() ? "" : ", ") + rival;
  ASSERT_FALSE(d.next.empty());
  EXPECT_EQ(d.next[0],
            effect.effect->name() + " and " + rivals +
                " cannot be told apart with these poses: " + effect.effect->info().settle);
}

TEST(Diagnose, PosesThatWouldTellEffectsApartAreWrittenOutWithTheirTensions) {
  const Robot robot = load_robot("irma4");
  Log log = startup_log(robot, kNoise, 21, 0);
  log.tension_N.rowwise() += Eigen::RowVector4d(9, -7, 11, -8);
  DiagnoseOptions options;
  options.rival_nats = 1e3;  // for one who wants to be that sure, others are rivals
  const Diagnosis d = diagnose(robot, {log}, options);
  ASSERT_EQ(d.effects.size(), 1U) << summary(d);
  const NamedEffect& effect = d.effects[0];
  ASSERT_EQ(effect.effect->name(), "load_cell_bias");
  ASSERT_EQ(d.next.size(), 1 + effect.rivals.size());
  const std::string number = R"((-?\d+\.\d\d))", pull = R"((\d+\.?\d*))";
  const std::regex place(R"(\()" + number + ", " + number + ", " + number +
                         R"(\) m from (above|below) \(tensions )" + pull + ", " + pull + ", " +
                         pull + ", " + pull + R"( N\))");
  for (std::size_t i = 0; i < effect.rivals.size(); ++i) {
    const std::string& text = d.next[1 + i];
    SCOPED_TRACE(text);
    EXPECT_EQ(text.find("to tell load_cell_bias from " + effect.rivals[i] + ", measure also at ("),
              0U);
    const auto first = std::sregex_iterator(text.begin(), text.end(), place);
    int poses = 0;
    for (auto it = first; it != std::sregex_iterator(); ++it, ++poses) {
      for (std::size_t cable = 0; cable < 4; ++cable) {
        const double tension_N = std::stod((*it)[5 + cable]);
        EXPECT_GE(tension_N, std::floor(robot.tension_min_N));
        EXPECT_LE(tension_N, std::ceil(robot.tension_max_N));
      }
    }
    EXPECT_GE(poses, 1);
    EXPECT_EQ(std::count(text.begin(), text.end(), '('), 2 * poses);
    const std::regex gain(R"(: the expected evidence goes from (\d+\.\d) to (\d+\.\d) nats$)");
    std::smatch nats;
    ASSERT_TRUE(std::regex_search(text, nats, gain));
    EXPECT_LT(std::stod(nats[1]), std::stod(nats[2]));
  }
}

TEST(Diagnose, AnotherEulerConventionIsSetInTheRobotFile) {
  // The platform's axes turned by a quarter, and a good AHRS: the order of the angles matters.
  Robot robot = load_robot("irma4");
  const Matrix3 turn = Eigen::AngleAxisd(-90.0 * kDegree, Vector3::UnitZ()).toRotationMatrix();
  for (Cable& cable : robot.cables) cable.platform_anchor_m = turn * cable.platform_anchor_m;
  robot.platform.centre_of_mass_m = turn * robot.platform.centre_of_mass_m;
  robot.platform.inertia_kg_m2 = turn * robot.platform.inertia_kg_m2 * turn.transpose();
  robot.sigma.attitude_rad = 0.05 * kDegree;
  Robot made = robot;
  made.euler_convention =
      made.euler_convention == EulerConvention::ZYX ? EulerConvention::XYZ : EulerConvention::ZYX;
  const Diagnosis d = diagnose(robot, {startup_log(made, kNoise, 45, 0)});
  ASSERT_EQ(d.faults.size(), 1U) << summary(d);
  EXPECT_EQ(d.faults[0].name, "euler_convention");
  EXPECT_EQ(d.corrected.euler_convention, made.euler_convention);
  EXPECT_TRUE(d.corrected.effects.empty());
  EXPECT_EQ(d.verdict, Verdict::explained);
}

TEST(Diagnose, VerdictsHaveNames) {
  EXPECT_STREQ(to_string(Verdict::consistent), "consistent");
  EXPECT_STREQ(to_string(Verdict::explained), "explained");
  EXPECT_STREQ(to_string(Verdict::unexplained), "unexplained");
}

TEST(Diagnose, RefusesLogsThatDoNotFit) {
  const Robot robot = load_robot("irma4");
  EXPECT_THROW(diagnose(robot, {}), InputError);
  EXPECT_THROW(diagnose(robot, {Log{}}), InputError);
  Log log = startup_log(robot, 0.0, 1);
  EXPECT_THROW(diagnose(robot, {log, Log{}}), InputError);
  for (LogMatrix* m : {&log.length_m, &log.swivel_rad, &log.tension_N, &log.tension_setpoint_N}) {
    *m = m->leftCols(3).eval();
  }
  EXPECT_THROW(diagnose(robot, {log}), InputError);
}

}  // namespace
}  // namespace cdprcal
