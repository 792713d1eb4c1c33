// What is left of each reading: readings that are off by known amounts leave these.
#include "cdprcal/diagnosis/model_residuals.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "../support/dense.hpp"
#include "../support/run.hpp"
#include "cdprcal/equilibria/inverse.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/workspace/grid.hpp"

namespace cdprcal {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kBias_N = 4.0, kDrift_rad_s = 1e-3, kHeavier_kg = 0.5;

/// What the readings of rest `i` are off by: another amount each.
struct Off {
  explicit Off(int i)
      : length_m(CableVector::LinSpaced(4, 0.001, 0.004) * (i + 1)),
        swivel_rad(CableVector::LinSpaced(4, -0.02, 0.03) * (i + 1)),
        direct_m(CableVector::LinSpaced(4, -0.005, 0.002) * (i + 1)),
        attitude_rad(Vector3(0.01, -0.02, 0.03) * (i + 1)),
        position_m(Vector3(-0.01, 0.02, 0.005) * (i + 1)),
        compass_rad(-0.04 * (i + 1)) {}
  CableVector length_m, swivel_rad, direct_m;
  Vector3 attitude_rad, position_m;
  double compass_rad;
};

/// Three equilibria of irma4 with half a kilogram more than its file says, read by everything, with
/// load cells that read too much and a drifting yaw; the model knows all of it.
DiagnosisModel known_model() {
  DiagnosisModel model;
  model.robot = load_robot("irma4");
  const int n = 4;
  Robot heavier = model.robot;
  heavier.platform.mass_kg += kHeavier_kg;
  const InverseSolver solver(heavier, {});
  DiagnosisRun run;
  run.offsets = Eigen::VectorXd::LinSpaced(2 * n + 1, -0.7, 0.9);
  const Box box = workspace_box(model.robot);
  for (int i = 0; i < 3; ++i) {
    const Vector3 share(0.4 + 0.1 * i, 0.55 - 0.05 * i, 0.45);
    const auto point = solver.solve(box.lower_m + share.cwiseProduct(box.upper_m - box.lower_m));
    EXPECT_EQ(point.status, EquilibriumStatus::found);
    const Pose pose{box.lower_m + share.cwiseProduct(box.upper_m - box.lower_m), point.rotation};
    const PlatformState state = platform_state(heavier, pose);
    const Off off(i);
    Measurement m;
    m.run_time_s = m.time_s = 10.0 * i;
    m.length_m = state.length_m() + run.offsets.head(n) - off.length_m;
    // Angles that are whole turns away are the same.
    m.swivel_rad =
        (state.swivel_rad() + run.offsets.segment(n, n) - off.swivel_rad).array() + kTurn;
    m.roll_pitch_yaw_rad = euler_from_rotation(state.rotation, heavier.euler_convention);
    m.absolute_yaw_rad = m.roll_pitch_yaw_rad[2] - off.compass_rad - kTurn;
    m.roll_pitch_yaw_rad -= off.attitude_rad + Vector3(0.0, 0.0, kTurn);
    m.roll_pitch_yaw_rad[2] += run.offsets[2 * n] + kDrift_rad_s * m.run_time_s;
    m.tension_N = point.tension_N.array() + kBias_N;
    m.direct_length_m = state.length_m() - off.direct_m;
    m.position_m = pose.position_m - off.position_m;
    run.measurements.push_back(m);
    run.rows.push_back({});
    run.poses.push_back(pose);
  }
  model.runs.push_back(run);
  model.effects.push_back({find_effect("load_cell_bias"), EffectValues::Constant(n, kBias_N)});
  model.effects.push_back({find_effect("mass"), EffectValues::Constant(1, kHeavier_kg)});
  model.effects.push_back({find_effect("yaw_drift"), EffectValues::Constant(1, kDrift_rad_s)});
  return model;
}

TEST(ModelResiduals, AreWhatTheReadingsAreOffBy) {
  const DiagnosisModel model = known_model();
  const std::vector<ModelResidual> left = model_residuals(model);
  ASSERT_EQ(left.size(), 3U);
  for (int i = 0; i < 3; ++i) {
    const ModelResidual& entry = left[static_cast<std::size_t>(i)];
    EXPECT_EQ(entry.run, 0U);
    EXPECT_EQ(entry.run_time_s, 10.0 * i);
    const PoseResidual& r = entry.residual;
    const Off off(i);
    EXPECT_LT((r.length_m - off.length_m).norm(), 1e-13);
    EXPECT_LT((r.swivel_rad - off.swivel_rad).norm(), 1e-13);
    EXPECT_LT((r.roll_pitch_yaw_rad - off.attitude_rad).norm(), 1e-13);
    EXPECT_NEAR(r.absolute_yaw_rad, off.compass_rad, 1e-13);
    EXPECT_LT((r.direct_length_m - off.direct_m).norm(), 1e-13);
    EXPECT_LT((r.position_m - off.position_m).norm(), 1e-13);
    // Tensions and mass are right once the effects are counted in.
    EXPECT_LT(r.wrench.norm(), 1e-6);
    EXPECT_LT(r.tension_N.norm(), 1e-6);
  }
}

TEST(ModelResiduals, TheWrenchIsSeenFromTheLoadCells) {
  DiagnosisModel model = known_model();
  const CableVector wrong_N = CableVector::LinSpaced(4, -2.0, 3.0);
  for (Measurement& m : model.runs[0].measurements) m.tension_N += wrong_N;
  const Robot robot = with_effects(model.robot, model.active(0));
  const std::vector<ModelResidual> left = model_residuals(model);
  for (std::size_t i = 0; i < left.size(); ++i) {
    const PlatformState state = platform_state(robot, model.runs[0].poses[i]);
    const WrenchMatrix structure = structure_matrix(state);
    EXPECT_LT((left[i].residual.wrench - structure * wrong_N).norm(), 1e-6);
    EXPECT_LT((left[i].residual.tension_N - wrong_N).norm(), 1e-6);  // four cables: all are seen
  }
}

TEST(ModelResiduals, WhatWasNotReadIsLeftOut) {
  DiagnosisModel model = known_model();
  std::vector<Measurement>& readings = model.runs[0].measurements;
  readings[0].balance_counts = false;
  readings[0].direct_length_m.resize(0);
  readings[0].swivel_rad[2] = kNaN;
  readings[1].kind = PoseKind::kinematic_pose;
  model.runs[0].poses[2].position_m.setConstant(kNaN);  // nothing can be said there
  const std::vector<ModelResidual> left = model_residuals(model);
  ASSERT_EQ(left.size(), 2U);
  for (const ModelResidual& entry : left) {
    EXPECT_TRUE(entry.residual.wrench.array().isNaN().all());
    ASSERT_EQ(entry.residual.tension_N.size(), 4);
    EXPECT_TRUE(entry.residual.tension_N.array().isNaN().all());
    EXPECT_TRUE(entry.residual.length_m.allFinite());
  }
  ASSERT_EQ(left[0].residual.direct_length_m.size(), 4);
  EXPECT_TRUE(left[0].residual.direct_length_m.array().isNaN().all());
  EXPECT_TRUE(left[1].residual.direct_length_m.allFinite());
  EXPECT_TRUE(std::isnan(left[0].residual.swivel_rad[2]));
  EXPECT_NEAR(left[0].residual.swivel_rad[1], Off(0).swivel_rad[1], 1e-13);
}

TEST(ModelResiduals, RunsComeOneAfterAnotherEachWithItsOwn) {
  DiagnosisModel model = known_model();
  model.runs.push_back(model.runs[0]);
  model.runs[1].offsets.array() += 0.1;
  model.effects[2].values = Eigen::Vector2d(kDrift_rad_s, -kDrift_rad_s);
  const std::vector<ModelResidual> left = model_residuals(model);
  ASSERT_EQ(left.size(), 6U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(left[i].run, 0U);
    EXPECT_EQ(left[3 + i].run, 1U);
    const PoseResidual &a = left[i].residual, &b = left[3 + i].residual;
    EXPECT_LT((b.length_m - a.length_m - CableVector::Constant(4, 0.1)).norm(), 1e-13);
    EXPECT_LT((b.swivel_rad - a.swivel_rad - CableVector::Constant(4, 0.1)).norm(), 1e-13);
    EXPECT_NEAR(b.roll_pitch_yaw_rad[2] - a.roll_pitch_yaw_rad[2],
                0.1 - 2.0 * kDrift_rad_s * left[i].run_time_s, 1e-13);
  }
}

TEST(FormulaCourse, IsOfAnEffectThatTheModelHas) {
  const DiagnosisModel model = known_model();
  EXPECT_FALSE(formula_course(model, 2));  // no formula
  EXPECT_THROW(formula_course(model, 3), InputError);
  EXPECT_THROW(formula_course(DiagnosisModel{}, 0), InputError);
}

}  // namespace
}  // namespace cdprcal
