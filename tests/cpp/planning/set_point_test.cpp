// Set-points, the grid of measurement positions and the box it fills.
#include "cdprcal/planning/set_point.hpp"

#include <gtest/gtest.h>

#include "../support/plan_robots.hpp"
#include "../support/table2.hpp"
#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

using test::kTable2;

TEST(PoseGrid, EightPositionsInTheBoxOfEq19AreThoseOfTableTwoInItsOrder) {
  const auto box = published_measurement_box(load_robot("irma4"));
  ASSERT_TRUE(box);
  const auto positions = grid_positions(*box, {2, 2, 2});
  ASSERT_EQ(positions.size(), kTable2.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    EXPECT_EQ(positions[i], kTable2[i].pose().position_m) << "row " << i + 1;
  }
}

TEST(PoseGrid, SerpentineVisitsEveryPositionOnceInShortSteps) {
  const Box box{{-1.0, -2.0, 0.0}, {1.0, 2.0, 3.0}};
  for (const std::array<int, 3>& counts :
       std::vector<std::array<int, 3>>{{3, 4, 5}, {2, 3, 4}, {5, 2, 3}, {1, 1, 4}}) {
    const auto positions = grid_positions(box, counts);
    ASSERT_EQ(positions.size(), static_cast<std::size_t>(counts[0] * counts[1] * counts[2]));
    Vector3 step;
    for (int a = 0; a < 3; ++a) {
      step[a] = (box.upper_m[a] - box.lower_m[a]) / std::max(1, counts[a] - 1);
    }
    for (std::size_t i = 0; i < positions.size(); ++i) {
      EXPECT_TRUE(box.contains(positions[i]));
      for (std::size_t j = 0; j < i; ++j) EXPECT_GT((positions[i] - positions[j]).norm(), 1e-3);
      if (i == 0) continue;
      const Vector3 steps = (positions[i] - positions[i - 1]).cwiseQuotient(step).cwiseAbs();
      EXPECT_NEAR(steps.sum(), 1.0, 1e-9) << "one step along one axis";
    }
  }
}

TEST(PoseGrid, RefusesCountsAndBoxesThatMakeNoGrid) {
  const Box box{{0, 0, 0}, {1, 1, 1}};
  EXPECT_THROW((void)grid_positions(box, {0, 2, 2}), InputError);
  EXPECT_THROW((void)grid_positions(box, {100, 100, 100}), InputError);
  EXPECT_THROW((void)grid_positions({{0, 0, 1}, {1, 1, 0}}, {2, 2, 2}), InputError);
  EXPECT_THROW((void)grid_positions({{0, 0, 1}, {1, 1, 1}}, {2, 2, 2}), InputError);
  EXPECT_THROW((void)grid_positions({{0, 0, kNaN}, {1, 1, 1}}, {2, 2, 2}), InputError);
  EXPECT_EQ(grid_positions({{0, 0, 1}, {1, 1, 1}}, {2, 2, 1}).size(), 4U);
}

TEST(SetPoint, EveryPositionOfTableTwoIsOne) {
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver(robot);
  for (const test::Table2Row& row : kTable2) {
    const auto result = solver.at(row.pose().position_m);
    ASSERT_TRUE(result.set_point) << result.reason;
    // The tensions settle the platform there: the direct problem, started from nothing.
    const EquilibriumResult rest = direct_from_tensions(robot, result.set_point->tension_N);
    ASSERT_EQ(rest.status, EquilibriumStatus::found);
    EXPECT_LT(minus(rest.pose, result.set_point->pose).norm(), 1e-6);
    EXPECT_GE(tension_margin_N(robot, result.set_point->tension_N), solver.margin_N());
  }
}

TEST(SetPoint, TableTwosOwnTensionsFollowFromTheirLambda) {
  const Robot robot = load_robot("irma4");
  for (const test::Table2Row& row : kTable2) {
    SetPointOptions options;
    options.distribution = TensionDistribution::given_lambda;
    options.lambda_N = lambda_of(robot, platform_state(robot, row.pose()), row.tension());
    const auto result = SetPointSolver(robot, options).at(row.pose().position_m);
    ASSERT_TRUE(result.set_point) << result.reason;
    EXPECT_LT((result.set_point->tension_N - row.tension()).norm(), 1e-2);
    EXPECT_LT(rotation_distance_rad(result.set_point->pose, row.pose()), 1e-4);
  }
}

TEST(SetPoint, SaysWhyAPositionIsNone) {
  const Robot robot = load_robot("irma4");
  const auto aside = SetPointSolver(robot).at({0.8, 0.9, 0.1});  // two cables would go slack
  EXPECT_FALSE(aside.set_point);
  EXPECT_NE(aside.reason.find("limits"), std::string::npos) << aside.reason;
  const auto high = SetPointSolver(robot).at({0.0, 0.0, 1.55});
  EXPECT_FALSE(high.set_point);
  EXPECT_FALSE(high.reason.empty());
  const auto above = SetPointSolver(robot).at({0.0, 0.0, 3.0});
  EXPECT_FALSE(above.set_point);
  EXPECT_FALSE(above.reason.empty());
  SetPointOptions wide;
  wide.tension_margin_N = 60.0;
  const auto low = SetPointSolver(robot, wide).at({0.4, 0.4, 0.6});
  EXPECT_FALSE(low.set_point);
  EXPECT_NE(low.reason.find("margin"), std::string::npos) << low.reason;
}

TEST(SetPoint, RefusesMarginsThatLeaveNothing) {
  const Robot robot = load_robot("irma4");
  for (const double margin : {-1.0, 190.0, kNaN, HUGE_VAL}) {
    SetPointOptions options;
    options.tension_margin_N = margin;
    EXPECT_THROW(SetPointSolver(robot, options), InputError) << margin;
  }
  EXPECT_THROW((void)SetPointSolver(robot).at({kNaN, 0.0, 1.0}), InputError);
}

TEST(SetPoint, SettlingDeviationIsWhatWrongTensionsDo) {
  const Robot robot = load_robot("irma4");
  const SetPoint set_point = *SetPointSolver(robot).at({0.3, -0.2, 0.8}).set_point;
  const double error_N = 1e-3;
  Vector6 square = Vector6::Zero();
  for (int i = 0; i < 4; ++i) {
    CableVector tension = set_point.tension_N;
    tension[i] += error_N;
    const EquilibriumResult rest = direct_from_tensions(robot, tension, set_point.pose);
    ASSERT_EQ(rest.status, EquilibriumStatus::found);
    square += (minus(rest.pose, set_point.pose) / error_N).cwiseAbs2();
  }
  const Vector6 expected = robot.sigma.tension_N * square.cwiseSqrt();
  const Vector6 deviation = settling_deviation(robot, set_point);
  for (int a = 0; a < 6; ++a) EXPECT_NEAR(deviation[a], expected[a], 1e-4 * expected.maxCoeff());
}

TEST(MeasurementBox, ThePublishedOneBelongsToItsRobotOnly) {
  Robot robot = load_robot("irma4");
  EXPECT_TRUE(published_measurement_box(robot));
  robot.cables[2].pulley.position_m.x() += 0.01;  // as a calibration would
  EXPECT_TRUE(published_measurement_box(robot));
  robot.cables[2].pulley.position_m.x() += 0.1;
  EXPECT_FALSE(published_measurement_box(robot));
  robot = load_robot("irma4");
  robot.name = "other";
  EXPECT_FALSE(published_measurement_box(robot));
}

TEST(MeasurementBox, AProposedOneHoldsSafeSetPointsOnly) {
  Robot robot = load_robot("irma4");
  robot.name = "other";
  const BoxProposal proposal = propose_measurement_box(robot);
  ASSERT_TRUE(proposal.box) << proposal.reason;
  EXPECT_GT(proposal.box->volume_m3(), 0.1);
  const SetPointSolver solver(robot);
  for (const Vector3& position : grid_positions(*proposal.box, {3, 3, 3})) {
    const auto result = solver.at(position);
    ASSERT_TRUE(result.set_point) << result.reason;
    EXPECT_TRUE(survives_tension_error(solver, *result.set_point));
  }
}

TEST(MeasurementBox, SaysWhyThereIsNone) {
  Robot robot = load_robot("irma4");
  robot.name = "weak";
  robot.tension_max_N = 41.0;  // 4 · 41 N carry 127 N only straight up
  finalise(robot);
  SetPointOptions options;
  options.tension_margin_N = 0.0;
  const BoxProposal proposal = propose_measurement_box(robot, options);
  EXPECT_FALSE(proposal.box);
  EXPECT_FALSE(proposal.reason.empty());
}

}  // namespace
}  // namespace cdprcal
