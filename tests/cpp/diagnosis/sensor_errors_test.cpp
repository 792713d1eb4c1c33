// Errors of sensors that are no finding: against their definition, and in logs that have them.
#include "cdprcal/diagnosis/sensor_errors.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "../support/dense.hpp"
#include "../support/run.hpp"
#include "cdprcal/diagnosis/diagnose.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal {
namespace {

DiagnosisModel smooth_model() {
  DiagnosisModel out = test::two_runs();
  out.effects.clear();
  return out;
}

/// What an effect adds to lengths, swivels and attitude, and to the wrench Ξᵀτ, at a measurement.
Eigen::VectorXd added(const Effect& effect, const EffectContext& context,
                      const EffectValues& values) {
  PoseEvaluation change;
  change.length_m = change.swivel_rad = CableVector::Zero(4);
  change.roll_pitch_yaw_rad.setZero();
  CableVector tension_N = CableVector::Zero(4);
  effect.add_to_readings(context, values, change);
  effect.correct_tension(context, values, tension_N);
  Eigen::VectorXd out(17);
  out << change.length_m, change.swivel_rad, change.roll_pitch_yaw_rad,
      structure_matrix(context.state) * tension_N;
  return out;
}

TEST(SensorErrors, ColumnsAreTheDerivativesOfWhatTheyAdd) {
  const DiagnosisModel of = smooth_model();
  EXPECT_FALSE(is_wandering_errors(*find_effect("mass")));
  EXPECT_FALSE(sensor_of_errors(*find_effect("mass")));
  Candidates all = smooth_errors(of, ErrorSize::any);
  ASSERT_EQ(all.size(), 6);  // of the place, of time
  for (std::size_t k = 0; k < all.size(); ++k) {
    EXPECT_EQ(reach_of_errors_m(*all[k]).has_value(), k < 3);
    EXPECT_EQ(is_wandering_errors(*all[k]), k >= 3);
  }
  all.push_back(wandering_errors(of, ErrorSize::any));
  ASSERT_EQ(all.back()->size(4), 5 * 15);
  EXPECT_TRUE(is_wandering_errors(*all.back()));
  const Candidates own = own_errors(of, 0.0);
  ASSERT_EQ(own.size(), sensors_with_like(of));  // a yaw has none like it
  EXPECT_LT(own_errors(of).size(), own.size());
  for (const auto& effect : own) {
    EXPECT_TRUE(sensor_of_errors(*effect));
    EXPECT_FALSE(reach_of_errors_m(*effect) || is_wandering_errors(*effect));
  }
  all.insert(all.end(), own.begin(), own.end());
  for (const auto& effect : all) {
    const DiagnosisRun& run = of.runs[0];
    const PlatformState state = platform_state(of.robot, run.poses[3]);
    const EffectContext context{of.robot, state, run.poses[3], run.measurements[3]};
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(17, effect->size(4));
    effect->columns(context, {}, columns);
    for (int j = 0; j < effect->size(4); ++j) {
      const EffectValues unit = EffectValues::Unit(effect->size(4), j);
      EXPECT_LE((columns.col(j) - added(*effect, context, unit)).norm(), 1e-12) << j;
    }
  }
}

/// What typical values add to the lengths of a cable at each rest of the first run, in σ of the
/// noise (rests × values).
Eigen::MatrixXd of_first_length(const DiagnosisModel& of, const Effect& effect) {
  const DiagnosisRun& run = of.runs[0];
  const EffectValues typical = effect.typical(of.robot);
  Eigen::MatrixXd out(static_cast<Eigen::Index>(run.poses.size()), typical.size());
  for (std::size_t i = 0; i < run.poses.size(); ++i) {
    const PlatformState state = platform_state(of.robot, run.poses[i]);
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(17, typical.size());
    effect.columns({of.robot, state, run.poses[i], run.measurements[i]}, {}, columns);
    out.row(static_cast<Eigen::Index>(i)) = columns.row(0) * typical.asDiagonal() / of.noise[0];
  }
  return out;
}

TEST(SmoothErrors, GoTogetherWherePlacesOrMomentsAreNear) {
  // cov(x, y) = exp(−|x − y|² / 2 reach²), up to the terms that are left out. With its mean: of
  // tensions and of roll and pitch nothing else stands for one.
  const DiagnosisModel of = smooth_model();
  const Candidates all = smooth_errors(of, ErrorSize::any);
  const DiagnosisRun& run = of.runs[0];
  std::vector<double> times_s;
  for (const DiagnosisRun& r : of.runs) {
    for (const Measurement& m : r.measurements) times_s.push_back(m.run_time_s);
  }
  std::ranges::sort(times_s);
  const auto repeated = std::ranges::unique(times_s);
  times_s.erase(repeated.begin(), repeated.end());
  double mean_s = 0.0, squares = 0.0;
  for (const double t : times_s) mean_s += t / static_cast<double>(times_s.size());
  for (const double t : times_s) squares += (t - mean_s) * (t - mean_s);
  const double reach_s = std::sqrt(squares / static_cast<double>(times_s.size()));
  for (const bool place : {true, false}) {
    const auto& errors = place ? all[2] : all[5];
    const double reach = place ? *reach_of_errors_m(*errors) : reach_s;
    const Eigen::MatrixXd length = of_first_length(of, *errors);
    for (std::size_t i = 0; i < run.poses.size(); ++i) {
      for (std::size_t j = 0; j < run.poses.size(); ++j) {
        const double apart = place
                                 ? (run.poses[i].position_m - run.poses[j].position_m).norm()
                                 : run.measurements[i].run_time_s - run.measurements[j].run_time_s;
        const auto row = [&](std::size_t k) { return length.row(static_cast<Eigen::Index>(k)); };
        EXPECT_NEAR(row(i).dot(row(j)), std::exp(-0.5 * std::pow(apart / reach, 2)), 0.02);
      }
    }
  }
}

TEST(SmoothErrors, ReachAsFarAsTheRestsAreSpread) {
  const DiagnosisModel of = smooth_model();
  std::vector<Vector3> at;
  Vector3 middle = Vector3::Zero();
  for (const DiagnosisRun& run : of.runs) {
    for (const Pose& pose : run.poses) at.push_back(pose.position_m);
  }
  for (const Vector3& place : at) middle += place / static_cast<double>(at.size());
  double squares = 0.0;
  for (const Vector3& place : at) squares += (place - middle).squaredNorm();
  const double spread_m = std::sqrt(squares / static_cast<double>(at.size()));
  const Candidates all = smooth_errors(of, ErrorSize::any);
  const double reaches[] = {0.5, 1.0, 2.0};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(*reach_of_errors_m(*all[k]), reaches[k] * spread_m, 1e-12);
  }
}

TEST(SensorErrors, AreRandomWalksInTime) {
  // cov(s, t) = 2 min(s, t) / T of each component, up to the terms that are left out; no two of
  // them go together.
  const DiagnosisModel of = smooth_model();
  const auto effect = wandering_errors(of, ErrorSize::any);
  const DiagnosisRun& run = of.runs[0];
  const EffectValues typical = effect->typical(of.robot);
  double duration_s = 0.0;
  for (const DiagnosisRun& r : of.runs) {
    for (const Measurement& m : r.measurements) duration_s = std::max(duration_s, m.run_time_s);
  }
  std::vector<Eigen::MatrixXd> lengths;
  for (std::size_t i = 0; i < run.poses.size(); ++i) {
    const PlatformState state = platform_state(of.robot, run.poses[i]);
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(17, typical.size());
    effect->columns({of.robot, state, run.poses[i], run.measurements[i]}, {}, columns);
    lengths.emplace_back(columns.topRows(4) * typical.asDiagonal() / of.noise[0]);
  }
  for (std::size_t i = 0; i < run.poses.size(); ++i) {
    for (std::size_t j = 0; j < run.poses.size(); ++j) {
      const double least =
          std::min(run.measurements[i].run_time_s, run.measurements[j].run_time_s) / duration_s;
      const Eigen::Matrix4d expected = 2.0 * least * Eigen::Matrix4d::Identity();
      EXPECT_LE((lengths[i] * lengths[j].transpose() - expected).cwiseAbs().maxCoeff(), 0.09);
    }
  }
}

TEST(SensorErrors, TheirSizeIsLearntChannelByChannel) {
  DiagnosisModel of = smooth_model();
  const auto effect = wandering_errors(of, ErrorSize::any);
  of.effects.push_back({effect, EffectValues::Zero(2L * effect->size(4))});
  ASSERT_TRUE(fit_with_noise(of));
  const EffectTerm& term = of.effects[0];
  ASSERT_EQ(term.learnt.size(), 5);
  // Yaws drift in these runs, and nothing else does.
  for (const int channel : {0, 1, 2}) EXPECT_GT(term.learnt[3], 3.0 * term.learnt[channel]);
  EXPECT_GT(rms_of_errors(of, term)[3], 3.0 * of.noise[3]);
  // The width is that of the values: squares over what the readings determine of them.
  const Eigen::VectorXd precision = prior_precision(of);
  const Eigen::VectorXd variance = covariance(of).diagonal().tail(precision.size());
  double squares = 0.0, determined = 0.0;
  const std::vector<int> groups = effect->learnt_widths(4);
  for (Eigen::Index j = 0; j < precision.size(); ++j) {
    if (groups[static_cast<std::size_t>(j) % groups.size()] != 3) continue;
    squares += precision[j] * term.values[j] * term.values[j];
    determined += 1.0 - precision[j] * variance[j];
  }
  EXPECT_NEAR(squares / determined, 1.0, 0.05);
}

TEST(SensorErrors, NothingIsSaidOfFewRests) {
  DiagnosisModel of = smooth_model();
  for (DiagnosisRun& run : of.runs) {
    run.measurements.resize(4);
    run.poses.resize(4);
  }
  EXPECT_FALSE(wandering_errors(of, ErrorSize::any));
  EXPECT_TRUE(smooth_errors(of, ErrorSize::any).empty());
}

/// A log in which one load cell, or one encoder, has an error of its own at every rest.
Log log_of_one_bad(const Robot& robot, LogMatrix Log::* read, int cable, double sigma,
                   std::uint64_t seed) {
  Log log = test::startup_log(robot, 0.02, seed);
  RandomNormal random(seed);
  double error = sigma * random();
  for (Eigen::Index row = 0; row < log.sample_count(); ++row) {
    const auto told = [&](Eigen::Index at) { return log.tension_setpoint_N.row(at); };
    if (row > 0 && told(row) != told(row - 1)) error = sigma * random();
    (log.*read)(row, cable) += error;
  }
  return log;
}

TEST(OwnErrors, ASensorThatIsWorseThanItsLikeIsNamedAndNoFinding) {
  const Robot robot = load_robot("irma4");
  int accused = 0, said = 0, others = 0;
  constexpr int kLogs = 6;
  for (std::uint64_t seed = 0; seed < kLogs; ++seed) {
    for (const bool cell : {true, false}) {
      const int cable = static_cast<int>(seed % 4);
      const Log log = cell ? log_of_one_bad(robot, &Log::tension_N, cable, 6.0, 300 + seed)
                           : log_of_one_bad(robot, &Log::length_m, cable, 6e-3, 300 + seed);
      const Diagnosis d = diagnose(robot, {log});
      accused += d.verdict == Verdict::consistent ? 0 : 1;
      const std::string column = std::string(cell ? "tension_" : "length_") +
                                 std::to_string(cable + 1) + (cell ? "_N" : "_m");
      for (const OwnErrors& own : d.own_errors) {
        if (own.column == column) {
          ++said;
          EXPECT_GT(own.rms, 2.0 * own.like);
          EXPECT_THAT(d.next, ::testing::Contains(
                                  ::testing::StartsWith(column + " has errors of its own")));
        } else {
          ++others;
        }
      }
    }
  }
  EXPECT_LE(accused, 1);
  EXPECT_GE(said, 2 * kLogs - 2);
  EXPECT_LE(others, 1);
}

TEST(OwnErrors, BeyondWhatAnySensorMayHaveAreAFinding) {
  Robot precise = load_robot("irma4");
  const Log log = log_of_one_bad(precise, &Log::tension_N, 2, 6.0, 300);
  precise.sigma.tension_N = 0.5;
  const Diagnosis d = diagnose(precise, {log});
  EXPECT_EQ(d.verdict, Verdict::unexplained);
  EXPECT_THAT(d.unexplained, ::testing::Contains(::testing::Field(&Unexplained::cable, 2)));
}

/// A log in which every reading wanders by so many σ of the robot file.
Log wandering_log(const Robot& robot, double sigmas, std::uint64_t seed) {
  Log log = test::startup_log(robot, 0.02, seed, 0);
  RandomNormal random(seed);
  const double step = sigmas * std::sqrt(2.0 / static_cast<double>(log.sample_count()));
  const auto walk = [&](auto&& column, double sigma) {
    double at = 0.0;
    for (double& v : column) v += at += step * sigma * random();
  };
  for (int c = 0; c < 4; ++c) {
    walk(log.length_m.col(c), robot.sigma.length_m);
    walk(log.swivel_rad.col(c), robot.sigma.swivel_rad);
    walk(log.tension_N.col(c), robot.sigma.tension_N);
    if (c < 3) walk(log.roll_pitch_yaw_rad.col(c), robot.sigma.attitude_rad);
  }
  return log;
}

TEST(SensorErrors, ASensorThatWandersIsNoFinding) {
  const Robot robot = load_robot("irma4");
  int accused = 0, said = 0;
  constexpr int kLogs = 10;
  for (std::uint64_t seed = 0; seed < kLogs; ++seed) {
    const Diagnosis d = diagnose(robot, {wandering_log(robot, 0.3, 900 + seed)});
    accused += d.verdict == Verdict::consistent ? 0 : 1;
    if (d.wandering.empty()) continue;
    ++said;
    EXPECT_GT(d.wandering[0].rms, 0.0);
    EXPECT_NE(d.next.back().find("errors that wander with time count as noise (" +
                                 d.wandering[0].channel),
              std::string::npos);
  }
  EXPECT_LE(accused, 1);
  EXPECT_GE(said, kLogs / 2);
}

/// A log in which every reading wanders about zero, by one σ of the robot file; white noise under a
/// Gaussian window of 15 s.
Log log_about_zero(const Robot& robot, std::uint64_t seed) {
  constexpr double kWindow_s = 15.0;
  Log log = test::startup_log(robot, 0.02, seed, 0);
  RandomNormal random(3000 + seed);
  const auto rows = static_cast<int>(log.sample_count());
  const double step_s = log.time_s[1] - log.time_s[0];
  const int half = static_cast<int>(3.0 * kWindow_s / step_s);
  Eigen::VectorXd window(2 * half + 1);
  for (int k = -half; k <= half; ++k) {
    window[half + k] = std::exp(-0.5 * std::pow(k * step_s / kWindow_s, 2));
  }
  window /= window.norm();
  const auto wander = [&](auto&& column, double sigma) {
    Eigen::VectorXd white(rows + 2 * half);
    for (double& v : white) v = random();
    for (int row = 0; row < rows; ++row) {
      column[row] += sigma * white.segment(row, window.size()).dot(window);
    }
  };
  for (int c = 0; c < 4; ++c) {
    wander(log.length_m.col(c), robot.sigma.length_m);
    wander(log.swivel_rad.col(c), robot.sigma.swivel_rad);
    wander(log.tension_N.col(c), robot.sigma.tension_N);
    if (c < 3) wander(log.roll_pitch_yaw_rad.col(c), robot.sigma.attitude_rad);
  }
  return log;
}

TEST(SmoothErrors, ThatWanderAboutZeroAreNoFinding) {
  const Robot robot = load_robot("irma4");
  int accused = 0;
  constexpr int kLogs = 10;
  for (std::uint64_t seed = 0; seed < kLogs; ++seed) {
    const Diagnosis d = diagnose(robot, {log_about_zero(robot, 200 + seed)});
    accused += d.verdict == Verdict::consistent ? 0 : 1;
  }
  EXPECT_LE(accused, 1);
}

/// A log whose readings are off by a smooth random function of the place, of so many σ of the robot
/// file: a sum of waves over the lengths of three cables.
Log placed_log(const Robot& robot, double sigmas, std::uint64_t seed) {
  constexpr int kWaves = 12;
  constexpr double kReach_m = 0.5;
  Log log = test::startup_log(robot, 0.02, seed);
  const Eigen::MatrixXd place_m = log.length_m.leftCols(3);
  RandomNormal random(1000 + seed);
  const auto field = [&](auto&& column, double sigma) {
    Eigen::VectorXd errors = Eigen::VectorXd::Zero(place_m.rows());
    for (int wave = 0; wave < kWaves; ++wave) {
      const double size = sigmas * sigma * std::sqrt(2.0 / kWaves) * random();
      const double phase = 2.0 * std::numbers::pi * random();
      const Eigen::Vector3d wave_number(random(), random(), random());
      errors.array() += size * ((place_m * wave_number).array() / kReach_m + phase).cos();
    }
    column.array() += errors.array();
  };
  for (int c = 0; c < 4; ++c) {
    field(log.length_m.col(c), robot.sigma.length_m);
    field(log.swivel_rad.col(c), robot.sigma.swivel_rad);
    field(log.tension_N.col(c), robot.sigma.tension_N);
    if (c < 3) field(log.roll_pitch_yaw_rad.col(c), robot.sigma.attitude_rad);
  }
  return log;
}

TEST(SensorErrors, OfAPlaceAreNoFindingWhereSensorsMayHaveThem) {
  const Robot robot = load_robot("irma4");
  int accused = 0, said = 0;
  constexpr int kLogs = 10;
  for (std::uint64_t seed = 0; seed < kLogs; ++seed) {
    const Diagnosis d = diagnose(robot, {placed_log(robot, 1.0, 700 + seed)});
    const bool clean = d.verdict == Verdict::consistent;
    accused += clean ? 0 : 1;
    if (clean && !d.discrepancy.channels.empty()) {
      ++said;
      EXPECT_THAT(d.next, ::testing::Contains(::testing::StartsWith(
                              "errors that change with the place count as noise (")));
    }
  }
  EXPECT_LE(accused, 1);
  EXPECT_GE(said, 1);
}

TEST(SensorErrors, OfASpecificationAreNoWiderThanIt) {
  DiagnosisModel of = smooth_model();
  const auto yaw_rad = [&](ErrorSize size) {
    const auto effect = wandering_errors(of, size);
    EXPECT_EQ(effect->widest().empty(), size == ErrorSize::any);
    DiagnosisModel with = of;
    with.effects.push_back({effect, EffectValues::Zero(2L * effect->size(4))});
    EXPECT_TRUE(fit_with_noise(with));
    constexpr int kYaw = 4 + 4 + 2;  // after lengths, swivels, roll and pitch
    return with.effects[0].learnt[3] * effect->typical(of.robot)[kYaw];
  };
  const double drift_rad = yaw_rad(ErrorSize::any);
  for (const double share : {0.5, 2.0}) {
    of.robot.sigma.attitude_rad *=
        share * drift_rad / specified_noise(of.robot.sigma).channel[3].pose;
    const double sigma_rad = specified_noise(of.robot.sigma).channel[3].pose;
    const double found_rad = yaw_rad(ErrorSize::specified);
    EXPECT_NEAR(found_rad, std::min(sigma_rad, drift_rad), 0.02 * drift_rad);
  }
}

TEST(SensorErrors, ThatAreBeyondTheSpecificationAreAFinding) {
  const Robot robot = load_robot("irma4");
  Robot precise = robot;
  precise.sigma.length_m = 1e-4;
  precise.sigma.swivel_rad = 1e-4;
  const Diagnosis d = diagnose(precise, {wandering_log(robot, 0.3, 900)});
  EXPECT_EQ(d.verdict, Verdict::unexplained);
}

}  // namespace
}  // namespace cdprcal
