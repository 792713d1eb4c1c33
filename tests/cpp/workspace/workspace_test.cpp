// Static workspace: what the flood finds, against the definitions.
#include "cdprcal/workspace/workspace.hpp"

#include <gtest/gtest.h>

#include <map>
#include <thread>

#include "../equilibria/robots.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/workspace/inscribed_box.hpp"

namespace cdprcal {
namespace {

using namespace test;  // NOLINT: test vocabulary

WorkspaceOptions coarse(double step_m) {
  WorkspaceOptions options;
  options.step_m = step_m;
  options.boundary_halvings = 0;
  return options;
}

const Box kPaperBox{{-0.4, -0.4, 0.6}, {0.4, 0.4, 1.2}};  // eq. 19

TEST(WorkspaceBox, FollowsThePulleys) {
  const Robot robot = irma4();
  const Box box = workspace_box(robot);
  EXPECT_NEAR(box.lower_m.x(), -1.066, 1e-12);
  EXPECT_NEAR(box.upper_m.y(), 1.155, 1e-12);
  EXPECT_NEAR(box.upper_m.z(), 1.839, 1e-12);
  EXPECT_EQ(box.lower_m.z(), 0.0);  // the floor
  Robot sunk = robot;
  for (Cable& cable : sunk.cables) cable.pulley.position_m.z() -= 1.839;
  EXPECT_NEAR(workspace_box(sunk).lower_m.z(), -2.31, 1e-12);  // no floor to speak of
}

TEST(Grid, PositionsAndIndicesGoBothWays) {
  const Grid grid = make_grid({{-1.0, 0.0, 0.5}, {1.0, 0.5, 1.05}}, 0.1);
  EXPECT_EQ(grid.count, (std::array<int, 3>{21, 6, 6}));
  for (std::int64_t k = 0; k < grid.size(); ++k) {
    const auto ijk = grid.coordinates(k);
    EXPECT_EQ(grid.index(ijk), k);
    const Vector3 p = grid.position_m(ijk);
    EXPECT_EQ(grid.nearest(p), ijk);
    EXPECT_TRUE(grid.box.contains(p, 1e-12));
  }
  EXPECT_NEAR(grid.origin_m.z(), 0.525, 1e-12);  // centred: 0.05 m is left over
}

TEST(Workspace, HoldsThePapersBox) {
  const Workspace w = compute_workspace(irma4(), coarse(0.08));
  ASSERT_TRUE(w.complete);
  EXPECT_TRUE(box_is_inside(w, kPaperBox));
  EXPECT_TRUE(explain_empty(w).empty());
}

TEST(Workspace, EveryPointInsideIsFeasibleBalancedAndStable) {
  const Robot robot = irma4();
  const Workspace w = compute_workspace(robot, coarse(0.12));
  ASSERT_GT(w.points_inside(), 1000);
  for (std::size_t row = 0; row < w.inside.size(); ++row) {
    const Pose pose{w.position_m(row), w.rotation[row]};
    const auto n = static_cast<std::size_t>(robot.cable_count());
    const CableVector tension =
        Eigen::Map<const Eigen::VectorXd>(w.tension_N.data() + row * n, robot.cable_count());
    EXPECT_LT(imbalance(robot, pose, tension), 1e-8 * robot.weight_N());
    EXPECT_GE(tension.minCoeff(), robot.tension_min_N - 1e-6);
    EXPECT_LE(tension.maxCoeff(), robot.tension_max_N + 1e-6);
    const Eigen::MatrixXd k = free_motion_stiffness(robot, platform_state(robot, pose), tension);
    EXPECT_EQ(k.llt().info(), Eigen::Success);
    EXPECT_EQ(w.solution[w.inside[row]], static_cast<std::int32_t>(row));
    EXPECT_EQ(w.status[w.inside[row]], PointStatus::inside);
  }
}

// The flood agrees with solving every point from nothing, except for a few at the very edge, where
// more than one equilibrium may exist and only the one that continues the interior counts.
TEST(Workspace, AgreesWithSolvingEveryPointFromNothing) {
  const Robot robot = irma4();
  const Workspace w = compute_workspace(robot, coarse(0.2));
  const InverseSolver solver(robot, {});
  int disagreements = 0;
  for (std::int64_t k = 0; k < w.grid.size(); ++k) {
    const bool found =
        solver.solve(w.grid.position_m(w.grid.coordinates(k))).status == EquilibriumStatus::found;
    if (found != (w.status[k] == PointStatus::inside)) ++disagreements;
  }
  EXPECT_LE(disagreements, w.grid.size() / 100);
}

TEST(Workspace, DoesNotDependOnTheNumberOfThreads) {
  WorkspaceOptions options = coarse(0.1);
  options.boundary_halvings = 3;
  options.threads = 1;
  const Workspace one = compute_workspace(irma4(), options);
  for (const int threads : {2, 3, 7}) {
    options.threads = threads;
    const Workspace many = compute_workspace(irma4(), options);
    EXPECT_EQ(many.status, one.status);
    EXPECT_EQ(many.inside, one.inside);
    EXPECT_EQ(many.tension_N, one.tension_N);
    EXPECT_EQ(many.boundary_m, one.boundary_m);
    for (std::size_t k = 0; k < one.rotation.size(); ++k) {
      EXPECT_EQ(many.rotation[k].coeffs(), one.rotation[k].coeffs());
    }
  }
}

TEST(Workspace, AnySeedInsideFindsTheSamePart) {
  WorkspaceOptions options = coarse(0.15);
  const Workspace reference = compute_workspace(irma4(), options);
  for (const Vector3& seed : {Vector3(0.0, 0.0, 1.0), Vector3(0.6, -0.5, 0.5)}) {
    options.seeds_m = {seed};
    const Workspace w = compute_workspace(irma4(), options);
    EXPECT_NEAR(static_cast<double>(w.points_inside()),
                static_cast<double>(reference.points_inside()),
                0.005 * static_cast<double>(reference.points_inside()));
  }
}

TEST(Workspace, OutsideCostsLittle) {
  // A box eight times as large, mostly empty: hardly more points are solved.
  const Robot robot = irma4();
  WorkspaceOptions options = coarse(0.1);
  options.seeds_m = {{0.0, 0.0, 1.0}};
  options.box = workspace_box(robot);
  const Workspace tight = compute_workspace(robot, options);
  Box large = *options.box;
  large.upper_m += Vector3(1.5, 1.5, 1.5);
  large.lower_m -= Vector3(1.5, 1.5, 0.0);
  options.box = large;
  const Workspace wide = compute_workspace(robot, options);
  EXPECT_GT(wide.grid.size(), 6 * tight.grid.size());
  EXPECT_LT(wide.points_tested, 2 * tight.points_tested);
}

TEST(Workspace, IsAsSymmetricAsTheRobot) {
  const Workspace w = compute_workspace(symmetric_irma4(), coarse(0.11));
  for (std::int64_t k = 0; k < w.grid.size(); ++k) {
    for (const int axis : {0, 1}) {
      auto mirror = w.grid.coordinates(k);
      mirror[axis] = w.grid.count[axis] - 1 - mirror[axis];
      const bool inside = w.status[k] == PointStatus::inside;
      EXPECT_EQ(w.status[w.grid.index(mirror)] == PointStatus::inside, inside);
    }
  }
}

TEST(Workspace, TurnsWithTheRobot) {
  const Robot robot = irma4();
  WorkspaceOptions options = coarse(0.11);
  options.box = Box{{-1.1, -1.1, 0.0}, {1.1, 1.1, 1.76}};
  const Workspace w = compute_workspace(robot, options);
  const Workspace quarter = compute_workspace(turned(robot, 0.5 * kPi), options);
  std::int64_t different = 0;
  for (std::int64_t k = 0; k < w.grid.size(); ++k) {
    const auto [i, j, h] = w.grid.coordinates(k);
    const std::int64_t turned = w.grid.index({w.grid.count[0] - 1 - j, i, h});  // (x, y) → (−y, x)
    if ((w.status[k] == PointStatus::inside) != (quarter.status[turned] == PointStatus::inside)) {
      ++different;
    }
  }
  EXPECT_LE(different, w.points_inside() / 1000);
}

TEST(Workspace, WiderLimitsHoldTheNarrower) {
  Robot robot = irma4();
  WorkspaceOptions options = coarse(0.15);
  options.inverse.distribution = TensionDistribution::minimum_norm;  // the same tensions in both
  const Workspace narrow = compute_workspace(robot, options);
  robot.tension_min_N = 5.0;
  robot.tension_max_N = 600.0;
  const Workspace wide = compute_workspace(robot, options);
  EXPECT_GT(wide.points_inside(), narrow.points_inside());
  for (const std::int64_t k : narrow.inside) EXPECT_EQ(wide.status[k], PointStatus::inside);
}

TEST(Workspace, BoundaryPointsAreInsideAndCloseToTheEdge) {
  WorkspaceOptions options = coarse(0.15);
  options.boundary_halvings = 6;
  const Robot robot = irma4();
  const Workspace w = compute_workspace(robot, options);
  ASSERT_GT(w.boundary_m.size(), 100U);
  int at_the_edge = 0;
  for (const Vector3& p : w.boundary_m) {
    EXPECT_TRUE(w.grid.box.contains(p, 1e-9));
    const InverseResult here = probe(w, p);
    EXPECT_EQ(here.status, EquilibriumStatus::found) << here.reason;
    // A hair further out along some axis it is over, or the box ends.
    const double hair = 1.01 * options.step_m / 64.0;
    bool edge = false;
    for (int axis = 0; axis < 3 && !edge; ++axis) {
      for (const double sign : {-1.0, 1.0}) {
        const Vector3 q = p + sign * hair * Vector3::Unit(axis);
        edge = edge || !w.grid.box.contains(q) ||
               inverse(robot, q, {}, here.pose.rotation).status != EquilibriumStatus::found;
      }
    }
    at_the_edge += edge ? 1 : 0;
  }
  EXPECT_GE(at_the_edge, static_cast<int>(0.99 * static_cast<double>(w.boundary_m.size())));
}

TEST(Workspace, ProbeGivesTheMarginToTheLimits) {
  const Robot robot = irma4();
  const Workspace w = compute_workspace(robot, coarse(0.15));
  const Vector3 position(0.123, -0.234, 0.9);
  const InverseResult at = probe(w, position);
  ASSERT_EQ(at.status, EquilibriumStatus::found);
  const double margin = std::min((at.tension_N.array() - robot.tension_min_N).minCoeff(),
                                 (robot.tension_max_N - at.tension_N.array()).minCoeff());
  EXPECT_NEAR(at.margin_N, margin, 1e-12);
  EXPECT_TRUE(in_solid_cell(w, position));
  EXPECT_FALSE(in_solid_cell(w, {0.0, 0.0, 5.0}));
  EXPECT_FALSE(in_solid_cell(w, {kNaN, 0.0, 1.0}));
  EXPECT_NE(probe(w, {1.05, 1.1, 1.8}).status, EquilibriumStatus::found);
}

TEST(Workspace, StoppingLeavesAUsablePartialResult) {
  WorkspaceOptions options = coarse(0.1);
  options.seeds_m = {{0.0, 0.0, 1.0}};
  int calls = 0;
  std::thread::id caller;
  options.progress = [&](const WorkspaceProgress& progress) {
    caller = std::this_thread::get_id();
    EXPECT_LE(progress.inside, progress.tested);
    EXPECT_LE(progress.tested, progress.total);
    return ++calls < 5;
  };
  const Workspace partial = compute_workspace(irma4(), options);
  EXPECT_EQ(caller, std::this_thread::get_id());
  EXPECT_FALSE(partial.complete);
  EXPECT_EQ(calls, 5);
  EXPECT_GT(partial.points_inside(), 0);
  options.progress = nullptr;
  const Workspace whole = compute_workspace(irma4(), options);
  EXPECT_TRUE(whole.complete);
  EXPECT_GT(whole.points_inside(), partial.points_inside());
  for (const std::int64_t k : partial.inside) EXPECT_EQ(whole.status[k], PointStatus::inside);
}

TEST(Workspace, AnEmptyOneSaysWhy) {
  Robot robot = irma4();
  robot.tension_min_N = 20.0;
  robot.tension_max_N = 25.0;  // cannot carry the weight
  const Workspace w = compute_workspace(robot, coarse(0.2));
  EXPECT_TRUE(w.complete);
  EXPECT_EQ(w.points_inside(), 0);
  EXPECT_TRUE(w.points_m().empty());
  EXPECT_FALSE(largest_inscribed_box(w).has_value());
  EXPECT_NE(explain_empty(w).find("outside the limits"), std::string::npos) << explain_empty(w);
}

TEST(Workspace, AnEmptyOneCountsWhatItsSeedsLack) {
  // Every seed is tested, and counted under the one thing that is wrong with it.
  const Robot robot = irma4();
  WorkspaceOptions options = coarse(0.05);
  options.box = Box{{0.9, 1.0, 1.5}, {1.0, 1.1, 1.8}};  // a corner under the roof
  options.seeds_m = {{0.9, 1.0, 1.5}, {1.0, 1.1, 1.5}, {1.0, 1.1, 1.8}};
  const Workspace w = compute_workspace(robot, options);
  ASSERT_EQ(w.points_inside(), 0);
  EXPECT_EQ(w.points_tested, 3);
  std::map<PointStatus, int> counted;
  const InverseSolver solver(robot, {});
  for (const Vector3& seed : options.seeds_m) {
    const auto at = w.grid.nearest(seed);
    const PointStatus status = w.status[w.grid.index(at)];
    ++counted[status];
    const EquilibriumStatus alone = solver.solve(w.grid.position_m(at)).status;
    EXPECT_EQ(status == PointStatus::infeasible, alone == EquilibriumStatus::infeasible);
    EXPECT_EQ(status == PointStatus::unstable, alone == EquilibriumStatus::unstable);
    EXPECT_EQ(status == PointStatus::no_equilibrium, rank(alone) >= rank(EquilibriumStatus::slack));
  }
  const auto count = [&](PointStatus status) { return std::to_string(counted[status]); };
  EXPECT_EQ(explain_empty(w), "no static workspace: of 3 seeds, " + count(PointStatus::infeasible) +
                                  " need tensions outside the limits, " +
                                  count(PointStatus::unstable) + " are unstable and " +
                                  count(PointStatus::no_equilibrium) +
                                  " have no equilibrium; check tension_limits_N, the mass and the "
                                  "box");
}

TEST(Workspace, ProbesWhereNoSolvedPointIsNear) {
  // The grid is a small box in the middle; a metre beside it the search starts from nothing.
  const Robot robot = irma4();
  WorkspaceOptions options = coarse(0.1);
  options.box = Box{{-0.2, -0.2, 0.8}, {0.0, 0.0, 1.0}};
  const Workspace w = compute_workspace(robot, options);
  const Vector3 far(0.5, 0.6, 0.7);
  const InverseResult probed = probe(w, far);
  const InverseResult alone = inverse(robot, far);
  ASSERT_EQ(alone.status, EquilibriumStatus::found);
  EXPECT_EQ(probed.status, EquilibriumStatus::found) << probed.reason;
  EXPECT_LT((probed.tension_N - alone.tension_N).norm(), 1e-6);
  EXPECT_THROW((void)probe(w, {kNaN, 0.0, 1.0}), InputError);
}

TEST(Workspace, NamesWhatItKnowsOfAPoint) {
  EXPECT_STREQ(to_string(PointStatus::untested), "untested");
  EXPECT_STREQ(to_string(PointStatus::inside), "inside");
  EXPECT_STREQ(to_string(PointStatus::infeasible), "infeasible");
  EXPECT_STREQ(to_string(PointStatus::unstable), "unstable");
  EXPECT_STREQ(to_string(PointStatus::no_equilibrium), "no_equilibrium");
}

TEST(Workspace, ThreeAndFiveCablesHaveOnesToo) {
  for (const int n : {3, 5}) {
    const Workspace w = compute_workspace(irma4_with_cables(n), coarse(0.2));
    EXPECT_GT(w.points_inside(), 50) << n << " cables";
  }
}

void expect_refused(const Robot& robot, const WorkspaceOptions& options, const std::string& word) {
  try {
    compute_workspace(robot, options);
    FAIL() << "accepted: " << word;
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
  }
}

TEST(Workspace, RefusesWhatMakesNoSense) {
  const Robot robot = irma4();
  WorkspaceOptions options;
  options.box = Box{{5.0, 5.0, 0.0}, {6.0, 6.0, 1.0}};
  expect_refused(robot, options, "beside all pulleys");
  options.box = Box{{-1.0, -1.0, 4.0}, {1.0, 1.0, 5.0}};
  expect_refused(robot, options, "above all pulleys");
  options.box = Box{{0.4, 0.4, 1.2}, {-0.4, -0.4, 0.6}};
  expect_refused(robot, options, "below upper_m");
  options.box = Box{{-0.4, -0.4, kNaN}, {0.4, 0.4, 1.2}};
  expect_refused(robot, options, "below upper_m");
  options.box = kPaperBox;
  options.step_m = 2.0;
  expect_refused(robot, options, "larger than the box");
  options.step_m = 0.0;
  expect_refused(robot, options, "step_m");
  options.step_m = 1e-5;
  expect_refused(robot, options, "200 million");
  options.step_m = 0.1;
  options.seeds_m = {{3.0, 0.0, 1.0}};
  expect_refused(robot, options, "seeds must be in the box");
  options.seeds_m.clear();
  options.threads = -1;
  expect_refused(robot, options, "threads");
  options.threads = 0;
  for (const int halvings : {-1, 21}) {
    options.boundary_halvings = halvings;
    expect_refused(robot, options, "boundary_halvings in 0 to 20");
  }
  options.boundary_halvings = 5;
  options.seeds_m = {{0.0, kNaN, 1.0}};
  expect_refused(robot, options, "seeds must be in the box");
  Robot limits = robot;
  limits.tension_min_N = 500.0;
  expect_refused(limits, coarse(0.2), "tension_limits_N");
}

}  // namespace
}  // namespace cdprcal
