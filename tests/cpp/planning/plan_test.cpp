// Whole plans: every stop an equilibrium, every way clear, and the properties that physics asks
// for.
#include "cdprcal/planning/plan.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "../support/plan_robots.hpp"
#include "../support/table2.hpp"
#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/planning/observability.hpp"

namespace cdprcal {
namespace {

double norm_of(const Vector6& sd, bool position) {
  return position ? sd.head<3>().norm() : sd.tail<3>().norm();
}

TEST(Plan, OfTheDefaultGridVisitsTheEightPositionsOfTableTwo) {
  const Robot robot = load_robot("irma4");
  const PlanResult result = make_plan(robot);
  ASSERT_EQ(result.status, PlanStatus::planned) << result.reason;
  const Plan& plan = result.plan;
  EXPECT_EQ(plan.robot_name, "irma4");
  EXPECT_TRUE(result.order_is_optimal);
  ASSERT_EQ(plan.poses.size(), 8U);
  double duration = plan.start_dwell_s;
  for (const test::Table2Row& row : test::kTable2) {
    EXPECT_EQ(std::count_if(plan.poses.begin(), plan.poses.end(),
                            [&](const PlannedPose& p) {
                              return (p.pose.position_m - row.pose().position_m).norm() < 1e-9;
                            }),
              1);
  }
  for (const PlannedPose& stop : plan.poses) {
    EXPECT_TRUE(stop.measured);
    const EquilibriumResult rest = direct_from_tensions(robot, stop.tension_N);
    ASSERT_EQ(rest.status, EquilibriumStatus::found);
    EXPECT_LT(minus(rest.pose, stop.pose).norm(), 1e-6);
    EXPECT_GE(tension_margin_N(robot, stop.tension_N), robot.sigma.tension_N);
    EXPECT_GT(stop.transition_s, 0.0);
    EXPECT_GE(stop.dwell_s, TimingOptions{}.measuring_s);
    EXPECT_EQ(stop.natural_frequencies_hz.size(), 2);
    EXPECT_EQ(stop.constant_tension_frequencies_hz.size(), 6);
    duration += stop.transition_s + stop.dwell_s;
  }
  EXPECT_NEAR(plan.duration_s, duration, 1e-9);
  const EquilibriumResult start = direct_from_tensions(robot, plan.start_tension_N);
  EXPECT_LT(minus(start.pose, plan.start_pose).norm(), 1e-6);
  EXPECT_LT((start.pose.position_m - Vector3(0.0, 0.0, 0.9)).norm(), 1e-6);
  EXPECT_TRUE(plan.predicted_standard_deviation.allFinite());
  EXPECT_EQ(verify_plan(robot, plan), "");
}

TEST(Plan, ByObservabilityNeedsFarFewerPosesThanTheGrid) {
  const Robot robot = load_robot("irma4");
  for (const auto& [counts, most] :
       std::vector<std::pair<std::array<int, 3>, int>>{{{2, 2, 2}, 4}, {{3, 3, 3}, 8}}) {
    PlanOptions options;
    options.grid = counts;
    options.optimal = most;
    const PlanResult result = make_plan(robot, options);
    ASSERT_EQ(result.status, PlanStatus::planned) << result.reason;
    ASSERT_TRUE(result.comparison);
    const GridComparison& c = *result.comparison;
    EXPECT_EQ(c.grid_poses, counts[0] * counts[1] * counts[2]);
    ASSERT_TRUE(c.poses_needed) << "not within " << most;
    const Vector6& enough = c.optimal_standard_deviation[*c.poses_needed - 1];
    for (const bool position : {true, false}) {
      EXPECT_LE(norm_of(enough, position), norm_of(c.grid_standard_deviation, position));
    }
    EXPECT_EQ(result.plan.measured_count(), most);
    // What the plan promises is what it gives: predicted anew from its own stops.
    std::vector<SetPoint> stops;
    for (const PlannedPose& p : result.plan.poses) {
      if (p.measured) stops.push_back({p.pose, p.tension_N});
    }
    const Vector6 again = square_roots(
        predicted_covariance(robot, {result.plan.start_pose, result.plan.start_tension_N}, stops));
    EXPECT_LT((again - c.optimal_standard_deviation.back()).norm(), 1e-9);
    EXPECT_LT((again - result.plan.predicted_standard_deviation).norm(), 1e-9);
  }
}

TEST(Plan, ByObservabilityStaysInTheBoxThatIsGiven) {
  const Robot robot = load_robot("irma4");
  PlanOptions options;
  options.optimal = 6;
  options.box = published_measurement_box(robot);
  const PlanResult result = make_plan(robot, options);
  ASSERT_EQ(result.status, PlanStatus::planned) << result.reason;
  for (const PlannedPose& p : result.plan.poses) {
    EXPECT_TRUE(options.box->contains(p.pose.position_m, 1e-9));
  }
  // Six of the box's set-points know more than six of its corners.
  const SetPointSolver solver(robot);
  auto corners = test::set_points_in(solver, *options.box, {2, 2, 2});
  corners.resize(6);
  const SetPoint start{result.plan.start_pose, result.plan.start_tension_N};
  EXPECT_LT(norm_of(result.plan.predicted_standard_deviation, true),
            norm_of(square_roots(predicted_covariance(robot, start, corners)), true));
}

TEST(Plan, GoesAroundAPathThatIsNotClear) {
  // The direct way between these two sags through the floor (path_test).
  const Robot robot = load_robot("irma4");
  PlanOptions options;
  options.positions_m = {{-0.6, -0.66, 0.4375}, {0.6, 0.66, 0.1}};
  options.home_m = Vector3(0.0, 0.0, 0.9);
  options.set_points.tension_margin_N = 0.0;
  const PlanResult result = make_plan(robot, options);
  ASSERT_EQ(result.status, PlanStatus::planned) << result.reason;
  EXPECT_EQ(result.plan.measured_count(), 2);
  ASSERT_EQ(result.plan.poses.size(), 3U);
  const PlannedPose& via = result.plan.poses[1];
  EXPECT_FALSE(via.measured);
  EXPECT_LT((via.pose.position_m - *options.home_m).norm(), 1e-9) << "by way of the start";
  EXPECT_EQ(verify_plan(robot, result.plan), "");
  // Without the detour the plan is refused.
  Plan direct = result.plan;
  direct.poses.erase(direct.poses.begin() + 1);
  EXPECT_NE(verify_plan(robot, direct).find("from stop 1 to stop 2"), std::string::npos);
}

TEST(Plan, RandomOrderVisitsEachPoseTwiceAndIsReproducible) {
  const Robot robot = load_robot("irma4");
  PlanOptions options;
  options.order = VisitingOrder::random;
  options.seed = 5;
  const PlanResult result = make_plan(robot, options);
  ASSERT_EQ(result.status, PlanStatus::planned) << result.reason;
  EXPECT_EQ(result.plan.measured_count(), 16);
  ASSERT_TRUE(result.approach);
  EXPECT_GT(result.approach->both, 0);
  const Plan again = make_plan(robot, options).plan;
  options.seed = 6;
  const Plan other = make_plan(robot, options).plan;
  int same = 0;
  for (std::size_t i = 0; i < 16; ++i) {
    EXPECT_EQ(again.poses[i].tension_N, result.plan.poses[i].tension_N);
    same += other.poses[i].tension_N == result.plan.poses[i].tension_N ? 1 : 0;
  }
  EXPECT_LT(same, 16);
}

TEST(Plan, DoesNotDependOnTheNumberOfThreads) {
  const Robot robot = load_robot("irma4");
  PlanOptions options;
  options.grid = {3, 3, 2};
  options.threads = 1;
  const Plan one = make_plan(robot, options).plan;
  options.threads = 4;
  const Plan four = make_plan(robot, options).plan;
  ASSERT_EQ(one.poses.size(), four.poses.size());
  for (std::size_t i = 0; i < one.poses.size(); ++i) {
    EXPECT_EQ(one.poses[i].tension_N, four.poses[i].tension_N);
    EXPECT_EQ(one.poses[i].transition_s, four.poses[i].transition_s);
  }
}

TEST(Plan, ScalingTheMassScalesTheTensionsAndNothingElse) {
  const Robot robot = load_robot("irma4");
  Robot heavy = robot;
  const double factor = 3.0;
  heavy.platform.mass_kg *= factor;
  heavy.platform.inertia_kg_m2 *= factor;
  heavy.tension_min_N *= factor;
  heavy.tension_max_N *= factor;
  heavy.sigma.tension_N *= factor;
  finalise(heavy);
  const Plan a = make_plan(robot).plan, b = make_plan(heavy).plan;
  ASSERT_EQ(a.poses.size(), b.poses.size());
  for (std::size_t i = 0; i < a.poses.size(); ++i) {
    EXPECT_LT((factor * a.poses[i].tension_N - b.poses[i].tension_N).norm(), 1e-6);
    EXPECT_LT(minus(a.poses[i].pose, b.poses[i].pose).norm(), 1e-9);
    EXPECT_LT((a.poses[i].natural_frequencies_hz - b.poses[i].natural_frequencies_hz).norm(), 1e-9);
    EXPECT_NEAR(a.poses[i].transition_s, b.poses[i].transition_s, 0.11);
  }
}

TEST(Plan, OfATurnedRobotIsTheTurnedPlan) {
  const Robot robot = load_robot("irma4");
  const double angle = 0.5 * kPi;  // turns boxes into boxes
  const Robot turned = test::turned(robot, angle);
  PlanOptions options;
  options.box = Box{{-0.3, -0.4, 0.7}, {0.5, 0.2, 1.1}};
  PlanOptions turned_options;
  turned_options.box = Box{{-0.2, -0.3, 0.7}, {0.4, 0.5, 1.1}};
  const PlanResult a = make_plan(robot, options), b = make_plan(turned, turned_options);
  ASSERT_EQ(a.status, PlanStatus::planned) << a.reason;
  ASSERT_EQ(b.status, PlanStatus::planned) << b.reason;
  EXPECT_NEAR(a.plan.duration_s, b.plan.duration_s, 0.5);
  const Eigen::Quaterniond turn = exp_so3({0.0, 0.0, angle});
  for (const PlannedPose& p : a.plan.poses) {
    const auto same = std::find_if(b.plan.poses.begin(), b.plan.poses.end(), [&](const auto& q) {
      return (q.pose.position_m - turn * p.pose.position_m).norm() < 1e-9;
    });
    ASSERT_NE(same, b.plan.poses.end());
    EXPECT_LT((same->tension_N - p.tension_N).norm(), 1e-5);
    EXPECT_LT((same->natural_frequencies_hz - p.natural_frequencies_hz).norm(), 1e-8);
  }
  for (const bool position : {true, false}) {
    // Euler angles are those of the world, so the attitude sensor turns what it knows.
    EXPECT_NEAR(norm_of(b.plan.predicted_standard_deviation, position) /
                    norm_of(a.plan.predicted_standard_deviation, position),
                1.0, 2e-3);
  }
}

TEST(Plan, ForRobotsOfThreeFourAndFiveCables) {
  test::Rng rng(21);
  for (int n = 3; n <= 5; ++n) {
    int planned = 0;
    for (int trial = 0; trial < 10 && planned < 2; ++trial) {
      Robot robot = test::random_robot(rng, n);
      robot.sigma.tension_N = 0.005 * robot.weight_N();
      finalise(robot);
      PlanOptions options;
      options.set_points.tension_margin_N = 0.0;
      const PlanResult result = make_plan(robot, options);
      if (result.status != PlanStatus::planned) {
        EXPECT_FALSE(result.reason.empty());
        EXPECT_TRUE(result.plan.poses.empty());
        continue;
      }
      ++planned;
      EXPECT_EQ(result.plan.measured_count(), 8);
      EXPECT_EQ(verify_plan(robot, result.plan), "");
      for (const PlannedPose& p : result.plan.poses) {
        EXPECT_EQ(p.natural_frequencies_hz.size(), 6 - n);
        const PlatformState state = platform_state(robot, p.pose);
        EXPECT_GT(stability(robot, state, p.tension_N).constant_tensions_N_m, 0.0);
      }
    }
    EXPECT_GE(planned, 1) << n << " cables";
  }
}

TEST(Plan, APoseThatIsNoSetPointIsAStatusThatNamesIt) {
  PlanOptions options;
  options.box = Box{{-0.4, -0.4, 0.6}, {0.4, 0.4, 1.7}};
  const PlanResult result = make_plan(load_robot("irma4"), options);
  EXPECT_EQ(result.status, PlanStatus::infeasible);
  EXPECT_NE(result.reason.find("1.7"), std::string::npos) << result.reason;
  EXPECT_TRUE(result.plan.poses.empty());
}

TEST(Plan, StopsWhenAsked) {
  for (const int optimal : {0, 3}) {
    std::set<std::string> stages;
    PlanOptions all;
    all.optimal = optimal;
    all.grid = {3, 3, 2};
    all.progress = [&](const PlanProgress& p) {
      EXPECT_GE(p.share, 0.0);
      EXPECT_LE(p.share, 1.0);
      stages.insert(p.stage);
      return true;
    };
    ASSERT_EQ(make_plan(load_robot("irma4"), all).status, PlanStatus::planned);
    EXPECT_GE(stages.size(), 4U);
    for (const std::string& stage : stages) {
      PlanOptions stopping = all;
      stopping.progress = [&](const PlanProgress& p) { return p.stage != stage; };
      const PlanResult result = make_plan(load_robot("irma4"), stopping);
      EXPECT_EQ(result.status, PlanStatus::stopped) << stage;
      EXPECT_TRUE(result.plan.poses.empty());
    }
    // An exception from the progress (Ctrl-C in a host language) passes through.
    PlanOptions throwing = all;
    throwing.progress = [](const PlanProgress& p) -> bool {
      if (std::string(p.stage) == "paths") throw std::runtime_error("interrupted");
      return true;
    };
    EXPECT_THROW((void)make_plan(load_robot("irma4"), throwing), std::runtime_error);
  }
}

TEST(Plan, RefusesOptionsThatMakeNoSense) {
  const Robot robot = load_robot("irma4");
  const auto refuses = [&](auto change) {
    PlanOptions options;
    change(options);
    EXPECT_THROW((void)make_plan(robot, options), InputError);
  };
  refuses([](PlanOptions& o) { o.optimal = -1; });
  refuses([](PlanOptions& o) { o.grid = {0, 2, 2}; });
  refuses([](PlanOptions& o) { o.box = Box{{9.0, 9.0, 0.0}, {10.0, 10.0, 1.0}}; });
  refuses([](PlanOptions& o) { o.box = Box{{0.4, 0.4, 1.0}, {-0.4, -0.4, 0.5}}; });
  refuses([](PlanOptions& o) { o.set_points.tension_margin_N = 500.0; });
  refuses([](PlanOptions& o) { o.timing.damping_ratio = -0.1; });
  refuses([](PlanOptions& o) {
    o.order = VisitingOrder::random;
    o.visits = 0;
  });
  test::Rng rng(1);
  EXPECT_THROW((void)make_plan(test::random_robot(rng, 2)), InputError);
}

TEST(VerifyPlan, CatchesAPlanOfAnotherModel) {
  const Robot robot = load_robot("irma4");
  Plan plan = make_plan(robot).plan;
  Robot other = robot;
  other.platform.mass_kg += 2.0;
  finalise(other);
  EXPECT_FALSE(verify_plan(other, plan).empty());
  test::Rng rng(2);
  EXPECT_THROW((void)verify_plan(test::random_robot(rng, 3), plan), InputError);
  plan.poses[3].tension_N[1] = 500.0;
  EXPECT_THROW((void)verify_plan(robot, plan), InputError);
}

}  // namespace
}  // namespace cdprcal
