// A result that cannot be trusted is never returned as if it could.
#include <gtest/gtest.h>

#include <functional>

#include "../support/scenario.hpp"
#include "cdprcal/effects/catalogue.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal::test {
namespace {

using ::testing::Test;

TEST(CalibrationStatus, FewerReadingsThanUnknownsIsUnobservable) {
  Scenario s = scenario(load_robot("irma4"), {irma4_setpoints()[0], irma4_setpoints()[1]},
                        PoseKind::kinematic_pose, 0.0, 1);
  s.problem.statics = StaticsModel::none;
  s.problem.reference_attitude = s.problem.reference_noise = false;
  const CalibrationResult result = solve(s.problem, s.truth);
  EXPECT_EQ(result.status, CalibrationStatus::unobservable);
  EXPECT_NE(result.reason.find("11 equations for 12 unknowns"), std::string::npos) << result.reason;
  EXPECT_FALSE(result.covariance);
}

TEST(CalibrationStatus, PosesInOnePlaceAreUnobservable) {
  // Many readings, all of the same pose: geometry alone says nothing about where it is.
  const std::vector<CableVector> same(12, irma4_setpoints()[0]);
  Scenario s = scenario(load_robot("irma4"), same, PoseKind::kinematic_pose, 0.0, 1);
  s.problem.statics = StaticsModel::none;
  const CalibrationResult result = solve(s.problem, s.truth);
  EXPECT_EQ(result.status, CalibrationStatus::unobservable) << result.reason;
  EXPECT_FALSE(result.covariance);
}

TEST(CalibrationStatus, ContradictedModelIsNotConverged) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.0, 1);
  for (Measurement& m : s.problem.measurements) m.swivel_rad = -m.swivel_rad;  // encoder signs
  const CalibrationResult result = solve(s.problem, s.truth);
  EXPECT_EQ(result.status, CalibrationStatus::not_converged);
  EXPECT_NE(result.reason.find("swivel"), std::string::npos) << result.reason;
}

TEST(CalibrationStatus, IterationLimitIsNotConverged) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.0, 1);
  SolveOptions options;
  options.max_iterations = 1;
  const CalibrationResult result =
      solve(s.problem, disturbed(s.truth, 0.2, 10.0 * kDegree, 3), options);
  EXPECT_EQ(result.status, CalibrationStatus::not_converged);
  EXPECT_FALSE(result.reason.empty());
  EXPECT_FALSE(result.covariance);
}

TEST(CalibrationStatus, StartOutsideTheGeometryIsNotConverged) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.0, 1);
  std::vector<Pose> guess = s.truth;
  // Anchor 1 on its pulley: no tangent exists.
  const Cable& cable = s.problem.robot.cables[0];
  guess[0].position_m = cable.pulley.position_m -
                        guess[0].rotation_matrix() * cable.platform_anchor_m +
                        0.5 * cable.pulley.radius_m * cable.pulley.x_axis();
  const CalibrationResult result = solve(s.problem, guess);
  EXPECT_EQ(result.status, CalibrationStatus::not_converged);
  EXPECT_TRUE(result.poses.empty() || std::isfinite(result.cost));
  EXPECT_FALSE(result.covariance);
}

TEST(CalibrationStatus, ExplainingChangesNothingButTheSentence) {
  for (const bool full : {true, false}) {
    Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.05, 1);
    s.problem.statics = full ? StaticsModel::wrench : StaticsModel::left_inverse;
    s.problem.reference_attitude = s.problem.reference_statics = s.problem.reference_noise = full;
    const std::vector<Pose> guess = disturbed(s.truth, 0.02, 1.0 * kDegree, 3);
    SolveOptions options;
    const CalibrationResult explained = solve(s.problem, guess, options);
    options.explain = false;
    CalibrationResult silent = solve(s.problem, guess, options);
    EXPECT_NE(explained.least_observed, "");
    EXPECT_EQ(silent.least_observed, "");
    EXPECT_EQ(silent.status, explained.status);
    EXPECT_EQ(silent.cost, explained.cost);
    ASSERT_TRUE(silent.covariance && explained.covariance);
    EXPECT_TRUE(silent.covariance->isApprox(*explained.covariance, 1e-12));
    explain(s.problem, silent);
    EXPECT_EQ(silent.least_observed, explained.least_observed);
  }
}

TEST(CalibrationStatus, WhatCannotBeSeenIsSaidUnasked) {
  // Eleven kinds of readings of one motion, for twelve unknowns.
  std::vector<CableVector> there(12, irma4_setpoints()[1]);
  there.front() = irma4_setpoints()[0];
  Scenario s = scenario(load_robot("irma4"), there, PoseKind::kinematic_pose, 0.0, 1);
  s.problem.statics = StaticsModel::none;
  s.problem.reference_attitude = s.problem.reference_noise = false;
  SolveOptions options;
  options.explain = false;
  const CalibrationResult result = solve(s.problem, s.truth, options);
  EXPECT_EQ(result.status, CalibrationStatus::unobservable) << result.reason;
  EXPECT_FALSE(result.covariance);
  EXPECT_NE(result.least_observed, "");
}

TEST(CalibrationStatus, WrongUseThrows) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.0, 1);
  std::vector<Pose> short_guess(s.truth.begin(), s.truth.end() - 1);
  EXPECT_THROW(solve(s.problem, short_guess), InputError);
  CalibrationProblem empty;
  empty.robot = s.problem.robot;
  EXPECT_THROW(solve(empty, {}), InputError);
  const auto expect_bad_options = [&](const auto& change) {
    SolveOptions options;
    change(options);
    EXPECT_THROW(solve(s.problem, s.truth, options), InputError);
  };
  expect_bad_options([](auto& o) { o.graduation = {10.0}; });
  expect_bad_options([](auto& o) { o.graduation = {-1.0, 1.0}; });
  expect_bad_options([](auto& o) { o.graduation = {kNaN, 1.0}; });
  expect_bad_options([](auto& o) { o.max_iterations = -5; });
  expect_bad_options([](auto& o) { o.function_tolerance = kNaN; });
  expect_bad_options([](auto& o) { o.parameter_tolerance = -1.0; });
  expect_bad_options([](auto& o) { o.gradient_tolerance = kNaN; });
  expect_bad_options([](auto& o) { o.settled = -1.0; });
  CalibrationProblem wrong = s.problem;
  wrong.measurements[2].length_m.resize(3);
  EXPECT_THROW(solve(wrong, s.truth), InputError);
  CalibrationProblem left = s.problem;
  left.statics = StaticsModel::left_inverse;
  left.left_inverse_rows = left_inverse_rows(3);  // for four cables
  EXPECT_THROW(solve(left, s.truth), InputError);
}

/// What `change` makes of a sound problem is refused with a message that names `field`.
void expect_refused(const std::string& field,
                    const std::function<void(CalibrationProblem&)>& change) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.0, 1);
  change(s.problem);
  try {
    solve(s.problem, s.truth);
    ADD_FAILURE() << field << " was accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(field), std::string::npos) << error.what();
  }
}

TEST(CalibrationStatus, ARobotThatIsNoneIsRefusedByItsField) {
  const double infinite = std::numeric_limits<double>::infinity();
  for (const double bad : {-1.0, 0.0, kNaN, infinite}) {
    expect_refused("sigma.length_m", [&](auto& p) { p.robot.sigma.length_m = bad; });
    expect_refused("sigma.tension_N", [&](auto& p) { p.robot.sigma.tension_N = bad; });
    expect_refused("mass_kg", [&](auto& p) { p.robot.platform.mass_kg = bad; });
  }
  for (const double bad : {-1.0, kNaN, infinite}) {
    expect_refused("sigma.wrench_force_N", [&](auto& p) { p.robot.sigma.wrench_force_N = bad; });
    expect_refused("cables[#2].pulley.radius_m",
                   [&](auto& p) { p.robot.cables[1].pulley.radius_m = bad; });
  }
  expect_refused("cables[#2].pulley.position_m",
                 [](auto& p) { p.robot.cables[1].pulley.position_m[0] = kNaN; });
  expect_refused("cables[#1].pulley.x_axis",
                 [](auto& p) { p.robot.cables[0].pulley.axes_world.setZero(); });
  expect_refused("12", [](auto& p) { p.robot.cables.resize(12, p.robot.cables[0]); });
}

TEST(CalibrationStatus, TheSigmaOfWhatIsNotReadMayBeAnything) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.0, 1);
  s.problem.robot.sigma.position_m = kNaN;
  EXPECT_EQ(solve(s.problem, s.truth).status, CalibrationStatus::converged);
}

TEST(CalibrationStatus, EffectsThatAreNoneAreRefused) {
  expect_refused("effects", [](auto& p) { p.effects.push_back({nullptr, {}}); });
  expect_refused("mass has 77 values", [](auto& p) {
    p.effects.push_back({find_effect("mass"), EffectValues::Zero(77)});
  });
  Robot robot = load_robot("irma4");
  robot.own_effects.push_back(nullptr);
  EXPECT_THROW(effects_of(robot), InputError);
}

}  // namespace
}  // namespace cdprcal::test
