// Paths between set-points: what is clear is clear, and what is not is caught.
#include "cdprcal/planning/path.hpp"

#include <gtest/gtest.h>

#include "../support/plan_robots.hpp"
#include "../support/table2.hpp"
#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/kinematics/obstruction.hpp"

namespace cdprcal {
namespace {

SetPointOptions without_margin() {
  SetPointOptions options;
  options.tension_margin_N = 0.0;
  return options;
}

SetPoint table2_set_point(const test::Table2Row& row) {
  const Robot robot = load_robot("irma4");
  const EquilibriumResult rest = direct_from_tensions(robot, row.tension());
  return {rest.pose, row.tension()};
}

TEST(Path, BetweenTheSetPointsOfTableTwoIsClearAndInEquilibrium) {
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver(robot);
  PathOptions options;
  options.tension_margin_N = 10.0;
  const PathChecker checker(solver, options);
  for (const auto& from : test::kTable2) {
    for (const auto& to : test::kTable2) {
      if (&from == &to) continue;
      const SetPoint end = table2_set_point(to);
      const Path path = checker.follow(table2_set_point(from), end);
      ASSERT_TRUE(path.clear()) << path.reason;
      EXPECT_EQ(path.points.back().fraction, 1.0);
      EXPECT_LT(minus(path.points.back().pose, end.pose).norm(), 1e-8);
      for (const PathPoint& point : path.points) {
        const PlatformState state = platform_state(robot, point.pose);
        EXPECT_LT(wrench_residual(robot, state, point.tension_N).norm(), 1e-6);
        EXPECT_GT(point.stiffness_N_m, 0.0);
      }
    }
  }
}

TEST(Path, APostBetweenTwoOfItsPointsIsSeen) {
  Robot robot = load_robot("irma4");
  const SetPoint from = table2_set_point(test::kTable2[0]), to = table2_set_point(test::kTable2[1]);
  const auto follow = [&] {
    const SetPointSolver solver(robot);
    return PathChecker(solver).follow(from, to);
  };
  const Path open = follow();
  ASSERT_TRUE(open.clear());
  const std::size_t k = open.points.size() / 2;
  const Pose &before = open.points[k].pose, &after = open.points[k + 1].pose;
  const Pose between = plus(before, 0.5 * minus(after, before));
  const PlatformState state = platform_state(robot, between);
  int posts = 0;
  for (const int cable : {0, 1, 2, 3}) {
    const Vector3 on_cable = between.position_m +
                             state.anchor_arm_m[static_cast<std::size_t>(cable)] -
                             0.5 * state.cable[static_cast<std::size_t>(cable)].direction;
    const Vector3 half(2e-3, 2e-3, 0.05);
    robot.surroundings.keep_out = {{on_cable - half, on_cable + half}};
    const auto clear = [&](const Pose& pose) {
      return is_clear(robot, pose, platform_state(robot, pose));
    };
    ASSERT_FALSE(clear(between));
    if (!clear(before) || !clear(after)) continue;  // it does not go sideways there
    ++posts;
    const Path path = follow();
    EXPECT_FALSE(path.clear());
    EXPECT_NE(path.reason.find("something is in the way"), std::string::npos) << path.reason;
  }
  EXPECT_GE(posts, 2);
}

TEST(Path, SpeedsAreTheDerivativesOfTheEquilibrium) {
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver(robot);
  const PathChecker checker(solver);
  const SetPoint from = table2_set_point(test::kTable2[1]), to = table2_set_point(test::kTable2[4]);
  const Path path = checker.follow(from, to);
  ASSERT_TRUE(path.clear());
  const double h = 1e-5;
  for (const PathPoint& point : path.points) {
    const auto at = [&](double fraction) {
      return direct_from_tensions(
                 robot, from.tension_N + fraction * (to.tension_N - from.tension_N), point.pose)
          .pose;
    };
    const Pose after = at(point.fraction + h), before = at(point.fraction - h);
    const Vector6 twist = (minus(after, point.pose) - minus(before, point.pose)) / (2.0 * h);
    EXPECT_LT((twist - point.twist_by_fraction).norm(), 1e-5 * (1.0 + twist.norm()));
    const CableVector lengths =
        (platform_state(robot, after).length_m() - platform_state(robot, before).length_m()) /
        (2.0 * h);
    EXPECT_LT((lengths - point.length_by_fraction_m).norm(), 1e-5 * (1.0 + lengths.norm()));
  }
}

TEST(Path, ThatSagsThroughTheFloorIsCaught) {
  // Two low set-points on opposite sides: half way between their tensions the platform hangs lower
  // than either, below the floor (z = 0).
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver(robot, without_margin());
  const SetPoint a = *solver.at({-0.6, -0.66, 0.4375}).set_point;
  const SetPoint b = *solver.at({0.6, 0.66, 0.1}).set_point;
  const Path path = PathChecker(solver).follow(a, b);
  EXPECT_EQ(path.status, PathStatus::outside_workspace);
  EXPECT_LT(path.points.back().pose.position_m.z(), 0.0);
  EXPECT_NE(path.reason.find("bounds"), std::string::npos) << path.reason;
  // It is the floor that is in the way: with room below, the same path is clear.
  PathOptions deep;
  deep.bounds = Box{{-1.0, -1.1, -0.5}, {1.0, 1.1, 1.5}};
  EXPECT_TRUE(PathChecker(solver, deep).follow(a, b).clear());
}

TEST(Path, ThatLeavesGivenBoundsIsCaught) {
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver(robot);
  PathOptions options;
  options.bounds =
      Box{{-0.41, -0.41, 0.0}, {0.41, 0.41, 1.0}};  // the platform rises above on its way
  const PathChecker checker(solver, options);
  const SetPoint a = *solver.at({-0.4, -0.4, 0.99}).set_point;
  const SetPoint b = *solver.at({0.4, 0.4, 0.6}).set_point;
  EXPECT_TRUE(checker.follow(a, b).clear());
  const SetPoint high = *solver.at({0.0, 0.0, 1.01}).set_point;
  EXPECT_EQ(checker.follow(a, high).status, PathStatus::outside_workspace);
}

TEST(Path, TensionsThatComeTooCloseToTheLimitsAreCaught) {
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver(robot, without_margin());
  PathOptions options;
  options.tension_margin_N = 20.0;
  const PathChecker checker(solver, options);
  const SetPoint home = *solver.at({0.0, 0.0, 0.9}).set_point;
  const SetPoint far = *solver.at({0.7, 0.7, 0.5}).set_point;  // 10 N from the lower limit
  const Path path = checker.follow(home, far);
  EXPECT_EQ(path.status, PathStatus::beyond_tension_limits);
  EXPECT_NEAR(tension_margin_N(robot, path.points.back().tension_N), 20.0, 5.0);
}

TEST(Path, WhereTheEquilibriumEndsIsCaughtWhereABruteForceSearchLosesItToo) {
  // Robots with anchors anywhere: many set-points, and paths on which stability is lost.
  test::Rng rng(5);
  int checked = 0;
  for (int trial = 0; trial < 30 && checked < 12; ++trial) {
    const Robot robot = test::random_robot(rng, 3 + trial % 3);
    const SetPointSolver solver(robot, without_margin());
    PathOptions wide;
    wide.bounds = Box{{-50, -50, -50}, {50, 50, 50}};
    const PathChecker checker(solver, wide);
    const auto points = test::set_points_in(solver, workspace_box(robot), {4, 4, 4});
    int of_this = 0;
    for (std::size_t i = 0; i + 1 < points.size() && of_this < 2; ++i) {
      const SetPoint& from = points[i];
      const SetPoint& to = points[i + 1];
      const Path path = checker.follow(from, to);
      if (path.status != PathStatus::unstable) continue;
      ++checked;
      ++of_this;
      // 4000 small steps with the solver of record: it must jump, or find nothing, no earlier than
      // the path's failure and soon after it.
      const double failed = path.points.back().fraction;
      double lost = 2.0;
      Pose pose = from.pose;
      for (int k = 1; k <= 4000; ++k) {
        const double s = k / 4000.0;
        const EquilibriumResult rest =
            direct_from_tensions(robot, from.tension_N + s * (to.tension_N - from.tension_N), pose);
        if (rest.status != EquilibriumStatus::found ||
            (rest.pose.position_m - pose.position_m).norm() > 0.1 ||
            rotation_distance_rad(rest.pose, pose) > 0.2) {
          lost = s;
          break;
        }
        pose = rest.pose;
      }
      EXPECT_GT(lost, failed - 1e-3) << path.reason;
      EXPECT_LT(lost, failed + 0.01) << path.reason;
    }
  }
  EXPECT_GE(checked, 6) << "no robot lost its equilibrium: the test shows nothing";
}

TEST(Path, ReversedIsTheWayBack) {
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver(robot);
  const PathChecker checker(solver);
  const SetPoint a = table2_set_point(test::kTable2[0]), b = table2_set_point(test::kTable2[5]);
  const Path back = reversed(checker.follow(a, b));
  EXPECT_EQ(back.points.front().fraction, 0.0);
  EXPECT_LT(minus(back.points.front().pose, b.pose).norm(), 1e-8);
  const Path direct = checker.follow(b, a);
  ASSERT_TRUE(direct.clear());
  EXPECT_LT(
      (direct.points.front().twist_by_fraction - back.points.front().twist_by_fraction).norm(),
      1e-6);
  EXPECT_LT(minus(direct.points.back().pose, back.points.back().pose).norm(), 1e-8);
}

TEST(Path, ThatArrivesElsewhereOrStartsNowhereIsCaught) {
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver(robot);
  const PathChecker checker(solver);
  const SetPoint a = table2_set_point(test::kTable2[0]);
  SetPoint wrong = table2_set_point(test::kTable2[1]);
  wrong.pose.position_m.x() += 0.05;  // not where these tensions settle the platform
  EXPECT_EQ(checker.follow(a, wrong).status, PathStatus::other_equilibrium);
  SetPoint nowhere = a;
  nowhere.pose.position_m.z() = 5.0;
  EXPECT_EQ(checker.follow(nowhere, a).status, PathStatus::unstable);
}

TEST(Path, HasANameForWhatIsWrongWithIt) {
  EXPECT_STREQ(to_string(PathStatus::clear), "clear");
  EXPECT_STREQ(to_string(PathStatus::unstable), "unstable");
  EXPECT_STREQ(to_string(PathStatus::other_equilibrium), "other_equilibrium");
  EXPECT_STREQ(to_string(PathStatus::beyond_tension_limits), "beyond_tension_limits");
  EXPECT_STREQ(to_string(PathStatus::outside_workspace), "outside_workspace");
}

TEST(Path, RefusesBoundsThatCannotBe) {
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver(robot);
  PathOptions options;
  options.bounds = Box{{0, 0, 1}, {1, 1, 0}};
  EXPECT_THROW(PathChecker(solver, options), InputError);
  options.bounds.reset();
  options.tension_margin_N = -1.0;
  EXPECT_THROW(PathChecker(solver, options), InputError);
}

}  // namespace
}  // namespace cdprcal
