// The linearised system behind the diagnosis, against one dense least-squares problem in which the
// poses are unknowns like all others: no elimination, no projections.
#include "cdprcal/estimation/model.hpp"

#include <gtest/gtest.h>

#include <random>

#include "../support/dense.hpp"
#include "../support/numeric_jacobian.hpp"
#include "../support/random_robot.hpp"
#include "../support/run.hpp"
#include "cdprcal/decompositions.hpp"

namespace cdprcal {
namespace {

using test::Dense;
using test::dense;
using test::jacobian_matches;
using test::two_runs;
using test::two_runs_baseline;

/// All residuals of a system, pose after pose.
Eigen::VectorXd residuals(const DiagnosisModel& model, bool with_balance = true) {
  std::vector<double> out;
  for (const test::PoseSystem& pose : test::poses_of(linearise(model))) {
    for (Eigen::Index row = 0; row < pose.residual.size(); ++row) {
      const bool balance = pose.channel[static_cast<std::size_t>(row)] == at_rest(Channel::balance);
      if (with_balance || !balance) out.push_back(pose.residual[row]);
    }
  }
  return Eigen::Map<Eigen::VectorXd>(out.data(), static_cast<Eigen::Index>(out.size()));
}

TEST(DiagnosisSystem, RowsAreReadingsOfTheirChannelOverItsNoise) {
  const DiagnosisModel& model = two_runs();
  const int n = model.robot.cable_count();
  for (const test::PoseSystem& pose : test::poses_of(linearise(model))) {
    const DiagnosisRun& run = model.runs[pose.run];
    const Measurement& m = run.measurements[pose.pose];
    const Robot robot = with_effects(model.robot, model.active(pose.run));
    const PlatformState state = platform_state(robot, run.poses[pose.pose]);
    ASSERT_EQ(pose.residual.size(), 2 * n + 9);  // everything is read, at rest
    for (int i = 0; i < n; ++i) {
      const double length = state.cable[i].length_m + run.offsets[i] - m.length_m[i];
      const double swivel = state.cable[i].swivel_rad + run.offsets[n + i] - m.swivel_rad[i];
      EXPECT_NEAR(pose.residual[i] * pose.scale[i], length, 1e-14);
      EXPECT_NEAR(pose.residual[n + i] * pose.scale[n + i], swivel, 1e-14);
    }
    const Vector3 angles = euler_from_rotation(state.rotation, robot.euler_convention);
    const double drift = model.effects[1].values[static_cast<Eigen::Index>(pose.run)];
    const Vector3 yaw(0.0, 0.0, run.offsets[2 * n] + drift * m.run_time_s);
    const Eigen::Index attitude = 2 * n;
    EXPECT_LE((pose.residual.segment<3>(attitude).cwiseProduct(pose.scale.segment<3>(attitude)) -
               (angles + yaw - m.roll_pitch_yaw_rad))
                  .norm(),
              1e-13);
    // The balance is whitened by its covariance: tensions' errors through the structure matrix and
    // the model's own wrench error.
    const CableVector tension = m.tension_N - model.effects[0].values;
    const Vector6 wrench = structure_matrix(state) * tension - gravity_wrench(robot, state);
    const SensorSigma& s = model.robot.sigma;
    Matrix6 spread =
        s.tension_N * s.tension_N * structure_matrix(state) * structure_matrix(state).transpose();
    spread.diagonal().head<3>().array() += s.wrench_force_N * s.wrench_force_N;
    spread.diagonal().tail<3>().array() += s.wrench_moment_Nm * s.wrench_moment_Nm;
    const double level = pose.scale[2 * n + 3];
    EXPECT_NEAR(pose.residual.tail<6>().squaredNorm() * level * level,
                wrench.dot(solve_symmetric(spread, wrench)), 1e-9);
    for (int row = 0; row < 2 * n + 9; ++row) {
      const auto at = static_cast<std::size_t>(row);
      const NoiseGroup channel = row < n            ? at_rest(Channel::length)
                                 : row < 2 * n      ? at_rest(Channel::swivel)
                                 : row < 2 * n + 2  ? at_rest(Channel::roll_pitch)
                                 : row == 2 * n + 2 ? at_rest(Channel::yaw)
                                                    : at_rest(Channel::balance);
      EXPECT_EQ(pose.channel[at], channel);
      const int first = row < n ? 0 : row < 2 * n ? n : row < 2 * n + 3 ? 2 * n : 2 * n + 3;
      EXPECT_EQ(pose.component[at], row - first);
    }
  }
}

TEST(DiagnosisSystem, OffsetsAreWhatReadingsAreAheadOfTheModelOrNothing) {
  const DiagnosisModel& model = two_runs();
  const int n = model.robot.cable_count();
  const Pose& pose = model.runs[0].poses[2];
  const PlatformState state = platform_state(model.robot, pose);
  const Eigen::VectorXd ahead = Eigen::VectorXd::LinSpaced(2 * n + 1, -0.3, 0.5);
  Measurement m;
  m.length_m = state.length_m() + ahead.head(n);
  m.swivel_rad = state.swivel_rad() + ahead.segment(n, n);
  m.roll_pitch_yaw_rad = euler_from_rotation(state.rotation, model.robot.euler_convention);
  m.roll_pitch_yaw_rad += Vector3(0.1, 0.1, ahead[2 * n]);
  EXPECT_LT((offsets_at(model.robot, pose, m) - ahead).norm(), 1e-14);
  m.length_m[1] = m.swivel_rad[2] = m.roll_pitch_yaw_rad[2] = kNaN;
  Eigen::VectorXd read = ahead;
  read[1] = read[n + 2] = read[2 * n] = 0.0;
  EXPECT_LT((offsets_at(model.robot, pose, m) - read).norm(), 1e-14);
}

TEST(DiagnosisSystem, AMeanOfFewerReadingsIsNoisierByItsRippleAlone) {
  DiagnosisModel model = two_runs();
  Measurement& m = model.runs[0].measurements[1];
  m.samples = static_cast<int>(model.rest_samples) / 4;
  const auto scale = [&](double floor, double level) {
    model.floor[0] = floor, model.noise[0] = level;
    return test::poses_of(linearise(model))[1].scale[0];
  };
  const double more = model.rest_samples / m.samples;  // times the variance of the mean
  EXPECT_NEAR(scale(2e-4, 2e-4), 2e-4 * std::sqrt(more), 1e-15);
  EXPECT_NEAR(scale(2e-4, 1e-3), std::sqrt(1e-6 + 4e-8 * (more - 1.0)), 1e-15);
  EXPECT_NEAR(scale(0.0, 1e-3), 1e-3, 1e-15);
  // No estimate is below the floor; were it so, all of the noise would be ripple.
  EXPECT_NEAR(scale(1e-3, 2e-4), 2e-4 * std::sqrt(more), 1e-15);
}

TEST(DiagnosisSystem, ColumnsAreTheDerivativesOfTheRows) {
  const DiagnosisModel& model = two_runs();
  const DiagnosisSystem system = linearise(model);
  const Dense all = dense(system);
  const Eigen::Index nuisance = system.layout.nuisance();
  ASSERT_EQ(nuisance, 2 * 9 + 4 + 2);
  const auto by_common = test::numeric_tangent_jacobian(
      [&](const Eigen::VectorXd& step) {
        DiagnosisModel moved = model;
        moved.runs[0].offsets += step.head(9);
        moved.runs[1].offsets += step.segment(9, 9);
        moved.effects[0].values += step.segment(18, 4);
        moved.effects[1].values += step.tail(2);
        return residuals(moved);
      },
      nuisance, 1e-2);
  EXPECT_TRUE(jacobian_matches(all.jacobian.rightCols(nuisance), by_common, 1e-7));
  // The balance's weights follow the pose, which Gauss-Newton leaves out: readings alone.
  const auto by_pose = test::numeric_tangent_jacobian(
      [&](const Eigen::VectorXd& step) {
        DiagnosisModel moved = model;
        for (DiagnosisRun& run : moved.runs) {
          for (Pose& pose : run.poses) pose = plus(pose, Vector6(step));
        }
        return residuals(moved, false);
      },
      6, 1e-3);
  Eigen::MatrixXd expected(by_pose.value.rows(), 6);
  Eigen::Index next = 0;
  for (const test::PoseSystem& pose : test::poses_of(system)) {
    for (Eigen::Index row = 0; row < pose.residual.size(); ++row) {
      if (pose.channel[static_cast<std::size_t>(row)] == at_rest(Channel::balance)) continue;
      expected.row(next++) = pose.by_pose.row(row);
    }
  }
  EXPECT_TRUE(jacobian_matches(expected, by_pose, 1e-7));
}

/// A model whose poses but the first are moments in motion, with tensions 8 N off.
DiagnosisModel noisy_moments() {
  DiagnosisModel model = two_runs_baseline();
  test::Rng rng(3);
  for (DiagnosisRun& run : model.runs) {
    for (std::size_t i = 1; i < run.measurements.size(); ++i) {
      Measurement& m = run.measurements[i];
      m.acceleration =
          0.3 * test::uniform_vector(rng, -Vector3::Ones(), Vector3::Ones()).replicate<2, 1>();
      m.inertial_sigma.setConstant(0.1);
      for (double& tension_N : m.tension_N) tension_N += test::uniform(rng, -8.0, 8.0);
    }
  }
  model.effects.push_back({find_effect("load_cell_gain"), EffectValues::Zero(4)});
  model.effects.push_back({find_effect("centre_of_mass"), EffectValues::Constant(3, 0.01)});
  return model;
}

TEST(DiagnosisSystem, InMotionTheGradientIsThatOfACostWhoseWeightsFollow) {
  const DiagnosisModel model = noisy_moments();
  const auto moments = [](const DiagnosisModel& at, const DiagnosisSystem& system) {
    std::vector<test::PoseSystem> out = test::poses_of(system);
    std::erase_if(out, [&](const test::PoseSystem& pose) {
      return !at.runs[pose.run].measurements[pose.pose].moves();
    });
    return out;
  };
  const auto cost = [&](const DiagnosisModel& at) {
    double squares = 0.0;
    for (const test::PoseSystem& pose : moments(at, linearise(at))) {
      squares += pose.residual.squaredNorm();
    }
    return Eigen::VectorXd(Eigen::VectorXd::Constant(1, 0.5 * squares));
  };
  const auto by_values = test::numeric_tangent_jacobian(
      [&](const Eigen::VectorXd& step) {
        DiagnosisModel moved = model;
        moved.effects[0].values += step.head(4);
        moved.effects[1].values += step.tail(3);
        return cost(moved);
      },
      7, 1e-3);
  const std::vector<test::PoseSystem> poses = moments(model, linearise(model));
  ASSERT_EQ(poses.size(), model.runs[0].poses.size() + model.runs[1].poses.size() - 2);
  Eigen::RowVectorXd gradient = Eigen::RowVectorXd::Zero(7);
  for (std::size_t k = 0; k < poses.size(); ++k) {
    gradient += poses[k].residual.transpose() * poses[k].by_common.rightCols(7);
    const auto by_pose = test::numeric_tangent_jacobian(
        [&](const Eigen::VectorXd& step) {
          DiagnosisModel moved = model;
          Pose& pose = moved.runs[poses[k].run].poses[poses[k].pose];
          pose = plus(pose, Vector6(step));
          return cost(moved);
        },
        6, 1e-4);
    EXPECT_TRUE(jacobian_matches(poses[k].residual.transpose() * poses[k].by_pose, by_pose, 1e-6));
  }
  EXPECT_TRUE(jacobian_matches(gradient, by_values, 1e-7));
}

TEST(DiagnosisSystem, NoiseOfLoadCellsInMotionIsNoGainOfTheirs) {
  // With derivatives by the tensions as read, moments at 50 N of noise would say that the gains are
  // (σ/τ)² too small, many times their own σ.
  const Robot robot = load_robot("irma4");
  std::vector<Log> logs{test::startup_log(robot, 0.1, 5)};
  std::vector<std::string> left_out;
  DiagnosisModel model = baseline_model(robot, logs, left_out);
  DiagnosisRun& run = model.runs.front();
  const std::size_t poses = run.poses.size();
  test::Rng rng(11);
  std::normal_distribution<double> noise_N(0.0, 50.0);
  for (std::size_t i = 1; i < poses; ++i) {
    Measurement& m = run.measurements[i];
    m.acceleration.setConstant(1e-9);
    const PlatformState state = platform_state(model.robot, run.poses[i]);
    m.tension_N = least_squares(structure_matrix(state), gravity_wrench(model.robot, state)).x;
  }
  constexpr int kCopies = 10;
  for (int copy = 1; copy < kCopies; ++copy) {
    for (std::size_t i = 1; i < poses; ++i) {
      run.measurements.push_back(run.measurements[i]);
      run.poses.push_back(run.poses[i]);
    }
  }
  for (std::size_t i = 1; i < run.measurements.size(); ++i) {
    for (double& tension_N : run.measurements[i].tension_N) tension_N += noise_N(rng);
  }
  model.robot.sigma.tension_N = 50.0;
  model.noise[static_cast<std::size_t>(at_rest(Channel::balance))] = 1.0;
  model.effects.push_back({find_effect("load_cell_gain"), EffectValues::Zero(4)});
  ASSERT_TRUE(fit(model));
  const Eigen::MatrixXd spread = covariance(model);
  const Eigen::VectorXd sigma = spread.diagonal().tail(4).cwiseSqrt();
  const Eigen::VectorXd z = model.effects.front().values.cwiseQuotient(sigma);
  EXPECT_LT(z.cwiseAbs().maxCoeff(), 3.5) << z.transpose();
  EXPECT_LT(z.squaredNorm(), 18.5) << z.transpose();  // χ² of 4: once in a thousand
}

TEST(DiagnosisSystem, LoadCellsThatSayTooMuchOfALighterPlatformFitNoBetter) {
  // Readings tell a platform of half the mass with load cells that show twice the tension from the
  // whole one by nothing at all; were the balance known no better for it, half of its residuals
  // would be gone.
  DiagnosisModel model = two_runs_baseline();
  model.effects.clear();
  const Eigen::VectorXd whole = residuals(model);
  const double mass_kg = model.robot.platform.mass_kg;
  model.effects.push_back({find_effect("mass"), EffectValues::Constant(1, -0.5 * mass_kg)});
  model.effects.push_back({find_effect("load_cell_gain"), EffectValues::Ones(4)});
  EXPECT_LE((residuals(model) - whole).norm(), 1e-9 * whole.norm());
}

TEST(DiagnosisSystem, ColumnsOfTheGeometryKnowTheTensionsThatOtherEffectsMakeOfTheReadings) {
  DiagnosisModel model = two_runs_baseline();
  model.effects.push_back({find_effect("load_cell_gain"), EffectValues::Constant(4, 0.4)});
  for (DiagnosisRun& run : model.runs) {  // known, and large
    run.known.push_back({find_effect("load_cell_bias"), Eigen::Vector4d(60.0, -50.0, 40.0, 30.0)});
  }
  for (const char* name : {"platform_anchors", "frame_anchors", "pulley_radius", "mass"}) {
    const auto effect = find_effect(name);
    model.effects.push_back({effect, 0.5 * effect->typical(load_robot("irma4"))});
  }
  // Weights that do not change with the geometry: the columns leave such changes out.
  SensorSigma& sigma = model.robot.sigma;
  sigma.tension_N = 1e-6;
  sigma.wrench_force_N = 2.0;
  sigma.wrench_moment_Nm = 1.5;
  const DiagnosisSystem system = linearise(model);
  const Eigen::Index accepted = system.layout.accepted;
  ASSERT_EQ(accepted, 4 + 12 + 12 + 4 + 1);
  const auto numeric = test::numeric_tangent_jacobian(
      [&](const Eigen::VectorXd& step) {
        DiagnosisModel moved = model;
        Eigen::Index at = 0;
        for (EffectTerm& term : moved.effects) {
          term.values += step.segment(at, term.values.size());
          at += term.values.size();
        }
        // What the balance may be wrong by goes with the weight: taken back here.
        const double heavier = with_effects(moved.robot, moved.active(0)).platform.mass_kg /
                               with_effects(model.robot, model.active(0)).platform.mass_kg;
        moved.robot.sigma.wrench_force_N /= heavier;
        moved.robot.sigma.wrench_moment_Nm /= heavier;
        return residuals(moved);
      },
      accepted, 1e-4);
  EXPECT_TRUE(jacobian_matches(dense(system).jacobian.rightCols(accepted), numeric, 1e-6));
}

TEST(DiagnosisSystem, CandidatesEnterAsAcceptedEffectsAtZeroDoInTypicalSizes) {
  DiagnosisModel model = two_runs();
  model.effects.clear();
  const Candidates candidates{find_effect("centre_of_mass"), find_effect("yaw_drift")};
  const DiagnosisSystem offered = linearise(model, candidates);
  for (const auto& effect : candidates) {
    const bool by_run = effect->info().scope == EffectScope::run;
    model.effects.push_back({effect, EffectValues::Zero(effect->size(4) * (by_run ? 2 : 1))});
  }
  const DiagnosisSystem accepted = linearise(model);
  ASSERT_EQ(offered.layout.size(), accepted.layout.size());
  ASSERT_EQ(offered.layout.candidates, 3 + 2);
  Eigen::MatrixXd columns = accepted.by_common.rightCols(5);
  columns.leftCols(3) *= candidates[0]->typical(load_robot("irma4")).asDiagonal();
  columns.rightCols(2) *= candidates[1]->typical(load_robot("irma4"))[0];
  EXPECT_LE((offered.by_common.rightCols(5) - columns).norm(), 1e-12 * columns.norm());
}

TEST(DiagnosisSystem, ReducedRowsAreWhatThePoseCannotExplain) {
  for (const test::PoseSystem& pose : test::poses_of(linearise(two_runs()))) {
    const Eigen::MatrixXd basis = range_basis(pose.by_pose);
    const auto off_pose = [&](const Eigen::MatrixXd& rows) -> Eigen::MatrixXd {
      return rows - basis * (basis.transpose() * rows);
    };
    EXPECT_LE((off_pose(pose.residual) - pose.free_residual).norm(), 1e-9);
    EXPECT_LE((off_pose(pose.by_common) - pose.free_by_common).norm(),
              1e-9 * pose.by_common.norm());
    const Eigen::Index size = pose.residual.size();
    const Eigen::MatrixXd projection = off_pose(Eigen::MatrixXd::Identity(size, size));
    EXPECT_LE((projection.diagonal() - pose.freedom).norm(), 1e-9);
    EXPECT_NEAR(pose.freedom.sum(), static_cast<double>(size - 6), 1e-9);
  }
}

TEST(DiagnosisSystem, MissingReadingsAndSlackTakeTheirRowsWithThem) {
  DiagnosisModel model = two_runs();
  Measurement& m = model.runs[1].measurements[2];
  m.length_m[1] = kNaN;
  m.swivel_rad[0] = kNaN;
  m.roll_pitch_yaw_rad[2] = kNaN;
  m.tension_N[3] = kNaN;
  const DiagnosisSystem system = linearise(model);
  const test::PoseSystem pose = test::poses_of(system)[model.runs[0].poses.size() + 2];
  ASSERT_EQ(pose.run, 1U);
  ASSERT_EQ(pose.pose, 2U);
  EXPECT_EQ(pose.component, (std::vector<int>{0, 2, 3, 1, 2, 3, 0, 1, 1, 2, 3, 4, 5}));
  ASSERT_EQ(pose.residual.size(), 13);  // one load cell less: five of the balance's six
  EXPECT_TRUE(pose.residual.allFinite());
  EXPECT_EQ(pose.by_common.rows(), 13);
  EXPECT_NEAR(pose.freedom.sum(), 7.0, 1e-9);
}

TEST(DiagnosisSystem, SingleReadingsInMotionAreGroupsOfTheirOwn) {
  DiagnosisModel model = two_runs();
  for (std::size_t c = 0; c < kNoiseGroups; ++c) {
    model.noise[c] = 1e-3 * static_cast<double>(c + 1);
    model.floor[c] = 0.5 * model.noise[c];
  }
  model.rest_samples = 40.0;
  Measurement& m = model.runs[0].measurements[3];
  m.kind = PoseKind::kinematic_pose;
  m.samples = 1;
  const test::PoseSystem alone = test::poses_of(linearise(model))[3];
  ASSERT_EQ(alone.residual.size(), 4 + 4 + 3);  // no balance in motion
  for (int row = 0; row < 11; ++row) {
    const auto at = static_cast<std::size_t>(row);
    const NoiseGroup channel = row < 4    ? in_motion(Channel::length)
                               : row < 8  ? in_motion(Channel::swivel)
                               : row < 10 ? in_motion(Channel::roll_pitch)
                                          : in_motion(Channel::yaw);
    EXPECT_EQ(alone.channel[at], channel) << row;
    // One reading is one reading: its noise is not that of a mean.
    EXPECT_EQ(alone.scale[row], model.noise[static_cast<std::size_t>(channel)]) << row;
    EXPECT_EQ(alone.component[at], row < 4 ? row : row < 8 ? row - 4 : row - 8) << row;
  }
  // The mean over an interval is none of these, whether the platform moves or not.
  m.samples = 10;
  const test::PoseSystem mean = test::poses_of(linearise(model))[3];
  for (const NoiseGroup channel : mean.channel) {
    EXPECT_LT(static_cast<int>(channel), kRestGroups);
  }
}

TEST(DiagnosisSystem, AnglesAreTheSameAfterAWholeTurn) {
  DiagnosisModel model = two_runs();
  const Eigen::VectorXd before = residuals(model);
  Measurement& m = model.runs[1].measurements[1];
  m.swivel_rad[2] += 2.0 * std::acos(-1.0);
  m.roll_pitch_yaw_rad[2] -= 2.0 * std::acos(-1.0);
  m.roll_pitch_yaw_rad[0] += 2.0 * std::acos(-1.0);
  EXPECT_LE((residuals(model) - before).norm(), 1e-9);
}

TEST(DiagnosisSystem, ValuesOfARunActOnTheirRunAlone) {
  DiagnosisModel model = two_runs();
  EXPECT_EQ(model.pose_count(),
            static_cast<int>(model.runs[0].poses.size() + model.runs[1].poses.size()));
  model.runs[1].known = {{find_effect("mass"), EffectValues::Constant(1, 0.3)}};
  for (const std::size_t run : {0U, 1U}) {
    const ActiveEffects active = model.active(run);
    ASSERT_EQ(active.size(), run == 0 ? 2U : 3U);
    EXPECT_EQ(active[0].values, model.effects[0].values);  // the robot's
    ASSERT_EQ(active[1].values.size(), 1);
    EXPECT_EQ(active[1].values[0], model.effects[1].values[static_cast<Eigen::Index>(run)]);
  }
  EXPECT_EQ(model.active(1)[2].effect->name(), "mass");
  // Known effects come after those with columns, and have none.
  EXPECT_EQ(linearise(model).layout.nuisance(), linearise(two_runs()).layout.nuisance());
}

TEST(DiagnosisSystem, GroupsHaveNames) {
  const std::vector<std::string> rest{
      "length",         "swivel",          "roll_pitch",    "yaw",
      "balance",        "absolute_yaw",    "direct_length", "position",
      "specific_force", "angular_velocity"};
  ASSERT_EQ(rest.size(), static_cast<std::size_t>(kRestGroups));
  for (std::size_t c = 0; c < kNoiseGroups; ++c) {
    const std::string expected =
        c < kRestGroups ? rest[c] : rest[c - kRestGroups] + " while moving";
    EXPECT_EQ(to_string(static_cast<NoiseGroup>(c)), expected);
  }
}

TEST(DiagnosisSystem, PriorsAreInTypicalSizesTimesWhatTheRobotTaught) {
  DiagnosisModel model = two_runs();
  model.effects[0].prior_scale = 2.0;
  const DiagnosisSystem system = linearise(model);
  EXPECT_EQ(system.prior_precision.head(18), Eigen::VectorXd::Zero(18));
  const double bias_N = 2.0 * find_effect("load_cell_bias")->typical(load_robot("irma4"))[0];
  const double drift = find_effect("yaw_drift")->typical(load_robot("irma4"))[0];
  double prior = 0.0;
  for (int i = 0; i < 6; ++i) {
    const double sigma = i < 4 ? bias_N : drift;
    const double value = i < 4 ? model.effects[0].values[i] : model.effects[1].values[i - 4];
    EXPECT_NEAR(system.prior_precision[18 + i] * sigma * sigma, 1.0, 1e-12);
    EXPECT_NEAR(system.prior_residual[18 + i], value / sigma, 1e-12);
    prior += 0.5 * value * value / (sigma * sigma);
  }
  EXPECT_NEAR(penalised_cost(model), 0.5 * dense(system).residual.squaredNorm() + prior, 1e-9);
}

TEST(DiagnosisSystem, InformationIsTheSchurComplementOfThePoses) {
  const DiagnosisSystem system = linearise(two_runs());
  const Dense all = dense(system);
  const Eigen::MatrixXd expected = all.covariance().bottomRightCorner(24, 24);
  EXPECT_LE((covariance(two_runs()) - expected).norm(), 1e-6 * expected.norm());
}

TEST(DiagnosisFit, IsTheMinimumOfThePenalisedCost) {
  constexpr double kNats = 0.01;  // far below what any decision turns on
  DiagnosisModel model = two_runs();
  ASSERT_TRUE(fit(model));  // at the noise that was estimated last
  const DiagnosisSystem system = linearise(model);
  const Dense all = dense(system);
  const Eigen::VectorXd gradient = all.gradient();
  EXPECT_LT(0.5 * gradient.dot(all.covariance() * gradient), kNats);  // another step's gain
  const double least = penalised_cost(model);
  DiagnosisModel moved = model;
  moved.effects[0].values *= 0.5;
  moved.effects[1].values *= -1.0;
  moved.runs[1].offsets.array() += 0.01;
  EXPECT_GT(penalised_cost(moved), least + 100.0);
  EXPECT_TRUE(fit(moved));
  EXPECT_NEAR(penalised_cost(moved), least, kNats);
  const Eigen::VectorXd deviation =
      all.covariance().diagonal().segment(all.poses + 18, 6).cwiseSqrt();
  for (int i = 0; i < 6; ++i) {
    const int k = i < 4 ? 0 : 1, j = i < 4 ? i : i - 4;
    EXPECT_NEAR(moved.effects[k].values[j], model.effects[k].values[j], 0.2 * deviation[i]);
  }
}

TEST(DiagnosisFit, FromFarAwayGoesDownAndFindsTheSameMinimum) {
  // Where a whole step would lead uphill or to no pose at all, a shorter one is taken: with whole
  // steps alone, three of these starts are lost.
  DiagnosisModel model = two_runs();
  ASSERT_TRUE(fit(model));
  const double least = penalised_cost(model);
  int lost = 0;
  for (int seed = 0; seed < 60; ++seed) {
    for (const double scale : {0.15, 0.2, 0.4}) {  // m and rad
      SCOPED_TRACE(seed);
      RandomNormal random(static_cast<std::uint64_t>(seed));
      DiagnosisModel far = model;
      for (DiagnosisRun& run : far.runs) {
        for (Pose& pose : run.poses) {
          Vector6 twist;
          for (double& v : twist) v = scale * random();
          pose = plus(pose, twist);
        }
      }
      const double before = penalised_cost(far);
      if (!std::isfinite(before)) continue;
      const bool settled = fit(far, 100);
      const double cost = penalised_cost(far);
      EXPECT_LE(cost, before);
      if (scale > 0.2) continue;                         // other minima
      const bool found = settled && cost < 2.0 * least;  // or one that is plainly another
      if (found) {
        EXPECT_NEAR(cost, least, 1e-6 * least);
      }
      lost += found ? 0 : 1;
    }
  }
  EXPECT_LE(lost, 1);
}

TEST(DiagnosisFit, StaysWhereItHasSettled) {
  // With all effects in it the weights of the balance change with nearly every unknown.
  DiagnosisModel model = two_runs_baseline();
  for (const auto& effect : effect_catalogue()) {
    const Eigen::Index runs = effect->info().scope == EffectScope::run ? 2 : 1;
    model.effects.push_back({effect, EffectValues::Zero(effect->size(4) * runs)});
  }
  ASSERT_TRUE(fit_with_noise(model));
  ASSERT_TRUE(fit(model));
  const double cost = penalised_cost(model);
  EXPECT_TRUE(fit(model));
  EXPECT_NEAR(penalised_cost(model), cost, 1e-3);
}

TEST(DiagnosisFit, SaysWhenItDoesNotSettle) {
  DiagnosisModel model = two_runs();
  model.runs[0].offsets.array() += 0.05;
  EXPECT_FALSE(fit(model, 1));
  EXPECT_FALSE(fit(model, 0));
}

TEST(NoiseEstimate, FreedomIsWhatTheLeveragesLeave) {
  const DiagnosisSystem system = linearise(two_runs());
  const Dense all = dense(system);
  const ChannelSums sums = channel_sums(two_runs());
  const NoiseLevels freedom = all.freedom();
  double total = 0.0;
  for (std::size_t c = 0; c < kNoiseGroups; ++c) {
    EXPECT_NEAR(sums.freedom[c], freedom[c], 1e-6);
    total += sums.freedom[c];
  }
  // All rows, less six a pose, less the common unknowns but for what their priors hold.
  const auto poses = static_cast<double>(system.poses.size());
  EXPECT_LE(total, poses * (17 - 6) - 24 + 6);
  EXPECT_GE(total, poses * (17 - 6) - 24 - 1e-9);
  const NoiseLevels squares = all.squares_off_poses();
  for (std::size_t c = 0; c < kNoiseGroups; ++c) EXPECT_NEAR(sums.squares[c], squares[c], 1e-9);
}

TEST(NoiseEstimate, IsTheRootMeanSquareOverTheFreedomAndNotBelowTheFloor) {
  DiagnosisModel model = two_runs();
  for (std::size_t c = 0; c < kRestGroups; ++c) model.noise[c] *= 1.5;
  model.floor[1] = 10.0 * model.noise[1];
  const NoiseLevels before = model.noise;
  const Dense all = dense(linearise(model));
  const NoiseLevels freedom = all.freedom(), squares = all.squares_off_poses();
  const double change = estimate_noise(model);
  double largest = 0.0;
  for (std::size_t c = 0; c < kRestGroups; ++c) {
    const double expected =
        c == 1 ? model.floor[1]
        : freedom[c] < 1.0
            ? before[c]  // nothing read it
            : std::max(model.floor[c], before[c] * std::sqrt(squares[c] / freedom[c]));
    EXPECT_NEAR(model.noise[c], expected, 1e-6 * expected) << c;
    largest = std::max(largest, std::abs(std::log(expected / before[c])));
  }
  EXPECT_NEAR(change, largest, 1e-6);
  EXPECT_NEAR(change, std::log(10.0), 1e-6);
  for (std::size_t c = kRestGroups; c < kNoiseGroups; ++c) {
    EXPECT_EQ(model.noise[c], before[c]);  // nothing was read in motion
  }
}

TEST(NoiseStart, IsTheSpecifiedOneAboveWhatMeansOfSoManyReadingsRipple) {
  DiagnosisModel model = two_runs();
  model.runs.resize(1);
  std::vector<Measurement>& at = model.runs[0].measurements;
  at.resize(5);
  at[0].kind = PoseKind::static_pose, at[0].samples = 40;
  at[1].kind = PoseKind::static_pose, at[1].samples = 1;      // a rest read once
  at[2].kind = PoseKind::kinematic_pose, at[2].samples = 13;  // a mean all the same
  at[3].kind = PoseKind::kinematic_pose, at[3].samples = 1;   // a reading in motion
  at[4].kind = PoseKind::static_pose, at[4].samples = 1;
  const SensorSigma& s = model.robot.sigma;
  Signals ripple{};
  ripple[0].sigma = 0.2 * s.length_m, ripple[1].sigma = 1e-9 * s.swivel_rad;
  ripple[4].sigma = 0.3 * s.tension_N;
  start_noise(model, ripple);
  EXPECT_DOUBLE_EQ(model.rest_samples, (40.0 + 1.0 + 13.0 + 1.0) / 4.0);
  const double mean = 1.0 / std::sqrt(13.75);
  EXPECT_DOUBLE_EQ(model.floor[0], 0.2 * s.length_m * mean);
  EXPECT_DOUBLE_EQ(model.floor[1], 1e-3 * s.swivel_rad);  // nothing is read without any noise
  EXPECT_DOUBLE_EQ(model.floor[4], 0.3 * mean);           // in units of the balance's covariance
  EXPECT_DOUBLE_EQ(model.floor[kRestGroups], 0.2 * s.length_m);
  EXPECT_DOUBLE_EQ(model.floor[kRestGroups + 1], 1e-3 * s.swivel_rad);
  EXPECT_DOUBLE_EQ(model.noise[0], s.length_m);
  EXPECT_DOUBLE_EQ(model.noise[4], 1.0);
  EXPECT_DOUBLE_EQ(model.noise[kRestGroups + 1], s.swivel_rad);

  // One rest is enough to count, and without any a mean is as good as a reading.
  at.resize(1);
  start_noise(model, ripple);
  EXPECT_EQ(model.rest_samples, 40.0);
  at[0] = Measurement();
  at[0].kind = PoseKind::kinematic_pose, at[0].samples = 1;
  start_noise(model, ripple);
  EXPECT_EQ(model.rest_samples, 1.0);
}

TEST(NoiseEstimate, HasSettledAfterAFitWithIt) {
  DiagnosisModel model = two_runs();
  ASSERT_TRUE(fit_with_noise(model));
  EXPECT_LT(estimate_noise(model), 0.02);
}

TEST(NoiseEstimate, WithLessThanOneDegreeOfFreedomTheRobotFileSpeaksForTheRest) {
  DiagnosisModel model = test::few_readings();
  model.noise[1] *= 3.0;
  model.noise[3] *= 3.0;
  const NoiseLevels before = model.noise;
  const Dense all = dense(linearise(model));
  const NoiseLevels freedom = all.freedom(), squares = all.squares_off_poses();
  ASSERT_LT(freedom[1], 1.0);
  ASSERT_GE(freedom[3], 1.0);
  ASSERT_LT(freedom[3], 2.0);
  estimate_noise(model);
  ASSERT_GT(freedom[1], 0.0);
  const double swivel = std::pow(before[1] * std::sqrt(squares[1] / freedom[1]), freedom[1]) *
                        std::pow(model.robot.sigma.swivel_rad, 1.0 - freedom[1]);
  EXPECT_NEAR(model.noise[1], std::max(model.floor[1], swivel), 1e-6 * swivel);
  const double yaw = std::max(model.floor[3], before[3] * std::sqrt(squares[3] / freedom[3]));
  EXPECT_NEAR(model.noise[3], yaw, 1e-6 * yaw);
  EXPECT_NE(model.noise[3], before[3]);
}

TEST(NoiseEstimate, IsTheNoiseThatWasAdded) {
  // A mean over a dwell of 40 samples of 0.2 sigma each; irma4's own sigma is for the mean.
  const DiagnosisModel& model = two_runs();
  const SensorSigma& s = model.robot.sigma;
  const double mean = 0.2 / std::sqrt(model.rest_samples);
  EXPECT_NEAR(model.noise[0], mean * s.length_m, 0.4 * mean * s.length_m);
  EXPECT_NEAR(model.noise[1], mean * s.swivel_rad, 0.4 * mean * s.swivel_rad);
  EXPECT_NEAR(model.noise[2], mean * s.attitude_rad, 0.4 * mean * s.attitude_rad);
  EXPECT_NEAR(model.noise[3], mean * s.attitude_rad, 0.4 * mean * s.attitude_rad);
  EXPECT_NEAR(model.noise[4], mean, 0.4 * mean);  // in units of the balance's own covariance
}

}  // namespace
}  // namespace cdprcal
