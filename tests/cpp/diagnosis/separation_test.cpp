#include "cdprcal/diagnosis/separation.hpp"

#include <gtest/gtest.h>

#include <set>

#include "../support/dense.hpp"
#include "../support/run.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/effects/applied.hpp"
#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/equilibria/inverse.hpp"
#include "cdprcal/workspace/grid.hpp"

namespace cdprcal {
namespace {

DiagnosisModel model_with(const std::string& effect, const EffectValues& values) {
  const Robot robot = load_robot("irma4");
  std::vector<Log> logs{test::startup_log(robot, 0.2, 5, 0)};
  std::vector<std::string> left_out;
  DiagnosisModel model = baseline_model(robot, logs, left_out);
  model.effects.push_back({find_effect(effect), values});
  return model;
}

TEST(SeparatingPoses, RaiseTheExpectedEvidenceOneByOneWithinTheLimits) {
  // Ratio errors and stretch: eight poses with little spread in tension.
  const DiagnosisModel model = model_with("cable_elasticity", EffectValues::Constant(1, 1e-5));
  const Separation found = separating_poses(model, 0, find_effect("transmission_ratio"), 3);
  ASSERT_FALSE(found.poses.empty());
  double reached = found.nats;
  for (const SeparatingPose& pose : found.poses) {
    EXPECT_GT(pose.nats, reached);
    reached = pose.nats;
    EXPECT_GE(pose.tension_N.minCoeff(), model.robot.tension_min_N - 1e-6);
    EXPECT_LE(pose.tension_N.maxCoeff(), model.robot.tension_max_N + 1e-6);
  }
}

TEST(SeparatingPoses, NoneTellAnEffectFromItself) {
  const DiagnosisModel model = model_with("mass", EffectValues::Constant(1, 0.7));
  const Separation found = separating_poses(model, 0, find_effect("mass"));
  // Only the rival's prior stands against it: half a nat for one typical size.
  EXPECT_LT(found.nats, 0.51);
  EXPECT_TRUE(found.poses.empty());
}

/// Evidence between an effect at its values and a rival in its place, from one dense problem: what
/// of the signature stays when offsets, other effects and the rival do what they can.
double nats_between(const DiagnosisModel& model, std::size_t k, const std::string& rival) {
  DiagnosisModel both = model;
  both.effects.erase(both.effects.begin() + static_cast<std::ptrdiff_t>(k));
  const EffectTerm truth = model.effects[k];
  const auto other = find_effect(rival);
  const auto zeros = [&](const Effect& effect) {
    const bool by_run = effect.info().scope == EffectScope::run;
    return EffectValues::Zero(effect.size(4) * (by_run ? model.runs.size() : 1));
  };
  both.effects.push_back({other, zeros(*other)});
  both.effects.push_back({truth.effect, zeros(*truth.effect)});
  const test::Dense all = test::dense(linearise(both));
  const Eigen::Index own = truth.values.size();
  const Eigen::VectorXd signature = all.jacobian.rightCols(own) * truth.values;
  const Eigen::Index others = all.jacobian.cols() - own;
  const Eigen::MatrixXd columns = all.jacobian.leftCols(others);
  Eigen::MatrixXd hessian = columns.transpose() * columns;
  hessian.diagonal() += all.precision.head(others);
  const Eigen::VectorXd unit = hessian.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = unit.asDiagonal() * hessian * unit.asDiagonal();
  const Eigen::VectorXd cross = unit.asDiagonal() * (columns.transpose() * signature);
  return 0.5 * (signature.squaredNorm() - cross.dot(solve_symmetric(scaled, cross)));
}

/// The model with the pose measured as it is offered, without noise.
DiagnosisModel measured_at(const DiagnosisModel& model, const SeparatingPose& offered) {
  DiagnosisModel out = model;
  DiagnosisRun& run = out.runs[0];
  Pose near{offered.position_m, run.poses.front().rotation};
  const EquilibriumResult rest = direct_from_tensions(model.robot, offered.tension_N, near);
  EXPECT_EQ(rest.status, EquilibriumStatus::found);
  EXPECT_LT((rest.pose.position_m - offered.position_m).norm(), 1e-6);  // they hold it there
  const PlatformState state = platform_state(model.robot, rest.pose);
  Measurement m;
  m.samples = static_cast<int>(std::round(model.rest_samples));
  for (const Measurement& other : run.measurements) {
    m.run_time_s = std::max(m.run_time_s, other.run_time_s);
  }
  m.tension_N = offered.tension_N;
  m.length_m = state.length_m() + run.offsets.head(4);
  m.swivel_rad = state.swivel_rad() + run.offsets.segment(4, 4);
  m.roll_pitch_yaw_rad = euler_from_rotation(state.rotation, model.robot.euler_convention);
  m.roll_pitch_yaw_rad[2] += run.offsets[8];
  m.length_direction = m.swivel_direction =
      CableVector::Constant(4, offered.from_above ? 1.0 : -1.0);
  run.measurements.push_back(m);
  run.rows.push_back({});
  run.poses.push_back(rest.pose);
  return out;
}

struct Pair {
  const char *effect, *rival;
  double value;
};

class SeparatingPair : public testing::TestWithParam<Pair> {};

TEST_P(SeparatingPair, KeepsWhatItPromises) {
  const Pair& pair = GetParam();
  const int size = find_effect(pair.effect)->size(4);
  DiagnosisModel model = model_with(pair.effect, EffectValues::Constant(size, pair.value));
  // One more effect that is known to be there, and stays free.
  model.effects.insert(model.effects.begin(), {find_effect("mass"), EffectValues::Zero(1)});
  const Separation found = separating_poses(model, 1, find_effect(pair.rival), 4);
  EXPECT_NEAR(found.nats, nats_between(model, 1, pair.rival), 1e-4 * (1.0 + found.nats));
  ASSERT_FALSE(found.poses.empty());
  EXPECT_LE(found.poses.size(), 4U);
  DiagnosisModel after = model;
  double reached = found.nats;
  for (const SeparatingPose& pose : found.poses) {
    after = measured_at(after, pose);
    EXPECT_NEAR(pose.nats, nats_between(after, 1, pair.rival), 1e-3 * pose.nats);
    EXPECT_GT(pose.nats, reached + 0.5);  // less is not worth the way
    reached = pose.nats;
  }
}

// Effects of tension, of the direction of motion, of time, and of what was read.
INSTANTIATE_TEST_SUITE_P(Effects, SeparatingPair,
                         testing::Values(Pair{"cable_elasticity", "transmission_ratio", 1e-5},
                                         Pair{"swivel_hysteresis", "swivel_scale", 0.02},
                                         Pair{"pulley_friction", "load_cell_gain", 0.05},
                                         Pair{"bending_hysteresis", "load_cell_bias", 0.02},
                                         Pair{"load_cell_drift", "load_cell_bias", 0.05},
                                         Pair{"yaw_drift", "ahrs_misalignment", 5e-4},
                                         Pair{"transmission_ratio", "cable_sag", 0.01},
                                         Pair{"cable_creep", "cable_elasticity", 0.01}),
                         [](const auto& one) { return std::string(one.param.effect); });

TEST(SeparatingPoses, AreOfferedToRobotsOfThreeToFiveCables) {
  for (const char* name : {"ring3", "ring5"}) {
    SCOPED_TRACE(name);
    const Robot robot = load_robot(name);
    std::vector<Log> logs{test::run_through(robot, default_setpoints(robot, 2, 2, 2), 0.2, 1)};
    std::vector<std::string> left_out;
    DiagnosisModel model = baseline_model(robot, logs, left_out);
    model.effects.push_back({find_effect("centre_of_mass"), EffectValues::Constant(3, 0.01)});
    const Separation found = separating_poses(model, 0, find_effect("external_force"), 2);
    EXPECT_FALSE(found.poses.empty());
    for (const SeparatingPose& pose : found.poses) {
      EXPECT_EQ(pose.tension_N.size(), robot.cable_count());
    }
  }
}

TEST(SeparatingPoses, TheFirstIsTheBestOfAllThatAreOffered) {
  const DiagnosisModel model = model_with("cable_elasticity", EffectValues::Constant(1, 1e-5));
  const auto rival = find_effect("transmission_ratio");
  const Separation one = separating_poses(model, 0, rival, 1);
  const Separation many = separating_poses(model, 0, rival, 4);
  ASSERT_EQ(one.poses.size(), 1U);
  ASSERT_GT(many.poses.size(), 1U);
  EXPECT_EQ(one.poses[0].nats, many.poses[0].nats);
  // Any of the others, measured first, tells less.
  for (std::size_t i = 1; i < many.poses.size(); ++i) {
    const DiagnosisModel after = measured_at(model, many.poses[i]);
    EXPECT_LE(nats_between(after, 0, "transmission_ratio"), one.poses[0].nats * (1.0 + 1e-6));
  }
  EXPECT_TRUE(separating_poses(model, 0, rival, 0).poses.empty());
}

TEST(SeparatingPoses, AreLookedForAllOverTheMiddleOfTheWorkspace) {
  // Seven tenths of the box along each side; what grows with tension is told apart at its rims.
  const DiagnosisModel stretch = model_with("cable_elasticity", EffectValues::Constant(1, 1e-5));
  const DiagnosisModel lever = model_with("centre_of_mass", EffectValues::Constant(3, 0.01));
  const Box box = workspace_box(stretch.robot);
  const Vector3 middle = 0.5 * (box.lower_m + box.upper_m), size = box.upper_m - box.lower_m;
  InverseOptions options;
  options.stability = StabilityNotion::constant_tensions;
  const InverseSolver solver(stretch.robot, options);
  int in_the_middle = 0, elsewhere = 0;  // of the tensions that are feasible there
  std::array<std::set<int>, 3> at;       // steps of the grid along each axis, from its lower rim
  const std::array<int, 3> most{3, 3, 2};
  const auto note = [&](const DiagnosisModel& model, const char* rival) {
    for (const SeparatingPose& pose : separating_poses(model, 0, find_effect(rival), 12).poses) {
      const CableVector tension_N = solver.solve(pose.position_m).tension_N;
      ((tension_N - pose.tension_N).norm() < 0.01 ? in_the_middle : elsewhere) += 1;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<Eigen::Index>(axis);
        const double share = (pose.position_m[i] - middle[i]) / (0.7 * size[i]) + 0.5;
        const double step = share * most[axis];
        EXPECT_NEAR(step, std::round(step), 1e-9);
        at[axis].insert(static_cast<int>(std::lround(step)));
      }
    }
  };
  note(stretch, "transmission_ratio");
  note(stretch, "pulley_friction");
  note(lever, "swivel_scale");
  note(lever, "platform_anchors");
  EXPECT_GT(in_the_middle, 0);
  EXPECT_GT(elsewhere, 0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(*at[axis].begin(), 0) << axis;
    // The highest layer has no equilibria within the limits of this robot's tensions.
    EXPECT_EQ(*at[axis].rbegin(), axis < 2 ? most[axis] : 1) << axis;
  }
}

TEST(SeparatingPoses, AreOfferedOnceAndFromTheSideThatTellsMore) {
  // Friction turns its sign with the direction of motion: from one side it is nearly a gain.
  const DiagnosisModel model = model_with("pulley_friction", EffectValues::Constant(1, 0.05));
  const auto rival = find_effect("load_cell_gain");
  const Separation found = separating_poses(model, 0, rival, 12);
  ASSERT_GT(found.poses.size(), 2U);
  std::set<bool> sides;
  for (std::size_t i = 0; i < found.poses.size(); ++i) {
    const SeparatingPose& one = found.poses[i];
    sides.insert(one.from_above);
    for (std::size_t j = 0; j < i; ++j) {
      const SeparatingPose& other = found.poses[j];
      EXPECT_FALSE(one.position_m == other.position_m && one.tension_N == other.tension_N &&
                   one.from_above == other.from_above)
          << i << " " << j;
    }
  }
  EXPECT_EQ(sides.size(), 2U);
  // The best, from its other side, tells less.
  SeparatingPose turned = found.poses[0];
  turned.from_above = !turned.from_above;
  EXPECT_LT(nats_between(measured_at(model, turned), 0, "load_cell_gain"), found.poses[0].nats);
}

TEST(SeparatingPoses, EndWhereAnotherIsNotWorthTheWay) {
  const DiagnosisModel model = model_with("cable_elasticity", EffectValues::Constant(1, 5e-6));
  const Separation found = separating_poses(model, 0, find_effect("transmission_ratio"), 1000);
  double reached = found.nats;
  for (const SeparatingPose& pose : found.poses) {
    EXPECT_GT(pose.nats, reached + 0.5);
    reached = pose.nats;
  }
  EXPECT_GT(found.poses.size(), 1U);
  EXPECT_LT(found.poses.size(), 50U);  // of nearly two hundred
}

TEST(SeparatingPoses, NoneForARobotWhoseInverseProblemIsNotSolved) {
  // Two cables more than can be distributed: the evidence of the log stands, nothing is offered.
  DiagnosisModel model = model_with("mass", EffectValues::Constant(1, 0.7));
  model.effects.clear();
  DiagnosisModel six = model;
  Robot& robot = six.robot;
  robot.cables.push_back(robot.cables[0]);
  robot.cables.push_back(robot.cables[1]);
  const auto longer = [](const CableVector& v) {
    CableVector out(6);
    out << v, v.head(2);
    return out;
  };
  for (DiagnosisRun& run : six.runs) {
    Eigen::VectorXd offsets(13);
    offsets << run.offsets.head(4), run.offsets.head(2), run.offsets.segment(4, 4),
        run.offsets.segment(4, 2), run.offsets[8];
    run.offsets = offsets;
    for (Measurement& m : run.measurements) {
      m.length_m = longer(m.length_m);
      m.swivel_rad = longer(m.swivel_rad);
      m.tension_N = longer(m.tension_N);
      m.length_direction = longer(m.length_direction);
      m.swivel_direction = longer(m.swivel_direction);
    }
  }
  six.effects.push_back({find_effect("mass"), EffectValues::Constant(1, 0.7)});
  const Separation found = separating_poses(six, 0, find_effect("load_cell_gain"));
  EXPECT_TRUE(found.poses.empty());
  EXPECT_GT(found.nats, 0.0);
}

TEST(RunNames, ShortestThatTellLogsApart) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(run_names({"a/run.csv", "b/other.csv"}), (Names{"run.csv", "other.csv"}));
  EXPECT_EQ(run_names({"x/a/run.csv", "x/b/run.csv"}), (Names{"a/run.csv", "b/run.csv"}));
  EXPECT_EQ(run_names({"run.csv", "b/run.csv"}), (Names{"run.csv", "b/run.csv"}));
  EXPECT_EQ(run_names({"same.csv", "same.csv"}), (Names{"same.csv", "same.csv"}));
  EXPECT_EQ(run_names({"/a/run.csv"}), (Names{"run.csv"}));
}

TEST(RunNames, AnEffectOfARunStaysWithItsLog) {
  Robot robot = load_robot("irma4");
  robot.effects.push_back({"yaw_drift", "a/run.csv", {{"rate_rad_s", {1e-4}}}});
  EXPECT_EQ(resolve_effects(robot, "/data/a/run.csv").size(), 1U);
  EXPECT_EQ(resolve_effects(robot, "a/run.csv").size(), 1U);
  EXPECT_TRUE(resolve_effects(robot, "/data/b/run.csv").empty());
  EXPECT_TRUE(resolve_effects(robot, "/data/aa/run.csv").empty());
}

TEST(SeparationByStops, AddsTheEvidenceOfThePosesThatSeparate) {
  const DiagnosisModel model = model_with("cable_elasticity", EffectValues::Constant(1, 1e-5));
  const auto rival = find_effect("transmission_ratio");
  const Separation grid = separating_poses(model, 0, rival, 2);
  ASSERT_EQ(grid.poses.size(), 2u);
  std::vector<OfferedRest> stops;
  for (const SeparatingPose& pose : grid.poses) {
    const InverseSolver solver(model.robot, InverseOptions{});
    const InverseSolver::Point there = solver.solve(pose.position_m);
    ASSERT_EQ(there.status, EquilibriumStatus::found);
    stops.push_back({{pose.position_m, there.rotation}, there.tension_N});
  }
  const StopSeparation found = separation_by_stops(model, 0, rival, stops);
  EXPECT_NEAR(found.nats, grid.nats, 1e-9 * grid.nats);
  ASSERT_EQ(found.nats_with.size(), 2u);
  for (const double nats : found.nats_with) {
    EXPECT_GT(nats, found.nats);
    EXPECT_LT(nats, found.nats_with_all);
  }
  EXPECT_EQ(separation_by_stops(model, 0, rival, {}).nats_with_all, found.nats);
}

TEST(SeparationByStops, KnowsWhenNoStopTellsThemApart) {
  // Weight and a force straight down are one; weight and friction are not.
  const DiagnosisModel model = model_with("mass", EffectValues::Constant(1, 0.7));
  EXPECT_FALSE(separation_by_stops(model, 0, find_effect("external_force"), {}).apart_with_all);
  EXPECT_TRUE(separation_by_stops(model, 0, find_effect("pulley_friction"), {}).apart_with_all);
}

TEST(ToldApart, ByEvidenceUnlessTheyDoTheSame) {
  EXPECT_TRUE(told_apart(4.0, 0.5));
  EXPECT_FALSE(told_apart(2.0, 0.5));
  EXPECT_FALSE(told_apart(8.0, 0.9));
  EXPECT_TRUE(told_apart(10.0, 0.9));
  EXPECT_FALSE(told_apart(1e6, 0.99));
  EXPECT_TRUE(told_apart(std::nullopt, 0.5));
  EXPECT_FALSE(told_apart(std::nullopt, 0.9));
}

}  // namespace
}  // namespace cdprcal
