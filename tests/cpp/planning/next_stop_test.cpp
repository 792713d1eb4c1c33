// Which stop to measure next: held to one dense problem without eliminations, stop by stop, and to
// ways followed one at a time.
#include "cdprcal/planning/next_stop.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <set>

#include "../support/plan_robots.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/estimation/linearise.hpp"
#include "cdprcal/planning/observability.hpp"
#include "support/refusal.hpp"

namespace cdprcal {
namespace {

using ::testing::HasSubstr;

Robot irma4_listing(std::vector<AppliedEffect> effects) {
  Robot robot = load_robot("irma4");
  robot.effects = std::move(effects);
  finalise(robot);
  return robot;
}

Plan plan_for(const Robot& robot, const PlanOptions& options = {}) {
  const PlanResult result = make_plan(robot, options);
  EXPECT_EQ(result.status, PlanStatus::planned) << result.reason;
  return result.plan;
}

SetPoint place(const PlannedPose& stop) { return {stop.pose, stop.tension_N}; }

/// Covariance of ζ0 when the start, τ0 and these stops are measured: the inverse of the dense
/// normal equations of all poses and reference errors, under a guess of 10 m and 1 rad.
Matrix6 dense_covariance(const Robot& robot, const Plan& plan, const std::vector<int>& stops) {
  std::vector<SetPoint> measured{{plan.start_pose, plan.start_tension_N}};
  for (const int stop : stops) measured.push_back(place(plan.poses[stop]));
  const CalibrationProblem problem = predicted_problem(robot, measured.front(), measured);
  std::vector<Pose> poses{plan.start_pose};
  for (const SetPoint& one : measured) poses.push_back(one.pose);
  const LinearisedProblem rows = linearise(problem, poses);
  EXPECT_LT(rows.residual.cwiseAbs().maxCoeff(), 1e-3) << "the readings are exact";
  Eigen::MatrixXd normal = rows.jacobian.transpose() * rows.jacobian;
  normal.diagonal().head<3>().array() += 1e-2;
  normal.diagonal().segment<3>(3).array() += 1.0;
  return normal.inverse().topLeftCorner<6, 6>();
}

double weighted_trace(const Matrix6& covariance, const AskedAccuracy& asked) {
  const Vector6 variance = covariance.diagonal();
  return variance.head<3>().sum() / std::pow(asked.position_m, 2) +
         variance.tail<3>().sum() / std::pow(asked.rotation_rad, 2);
}

TEST(AskedAccuracy, IsReachedWhenTheWorstAxisIsWhicheverWayItPoints) {
  const AskedAccuracy asked{5e-3, 0.01};
  // 4.9 mm along two axes, but 6.3 mm half-way between them.
  Matrix6 covariance = Vector6(1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6).asDiagonal();
  covariance(0, 0) = covariance(1, 1) = std::pow(4.9e-3, 2);
  EXPECT_TRUE(reached(covariance, asked));
  covariance(0, 1) = covariance(1, 0) = 0.65 * covariance(0, 0);
  EXPECT_FALSE(reached(covariance, asked));
  EXPECT_TRUE(reached(covariance, {4.9e-3 * std::sqrt(1.65) * (1.0 + 1e-9), 0.01}));
  EXPECT_FALSE(reached(covariance, {4.9e-3 * std::sqrt(1.65) * (1.0 - 1e-9), 0.01}));
  // Rotations count as well, and by themselves.
  covariance = 1e-6 * Matrix6::Identity();
  EXPECT_TRUE(reached(covariance, asked));
  covariance(5, 5) = std::pow(0.0101, 2);
  EXPECT_FALSE(reached(covariance, asked));
  EXPECT_FALSE(reached(Matrix6::Constant(kNaN), asked));
}

class NextStops : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { plan = new Plan(plan_for(load_robot("irma4"))); }
  static void TearDownTestSuite() {
    delete plan;
    plan = nullptr;
  }
  const Robot robot = load_robot("irma4");
  static const Plan* plan;
};
const Plan* NextStops::plan = nullptr;

TEST_F(NextStops, TeachMostPerSecondOfAllThatAreLeft) {
  const NextStopChooser chooser(robot, *plan, 1);
  // The ways, followed one at a time.
  const SetPointSolver solver(robot);
  PathOptions path_options;
  path_options.tension_margin_N = robot.sigma.tension_N;
  const PathChecker checker(solver, path_options);
  const TransitionTimer timer(checker);
  const auto time_s = [&](const SetPoint& from, const SetPoint& to) {
    const Path path = checker.follow(from, to);
    EXPECT_TRUE(path.clear()) << path.reason;
    return timer.time(path)->total_s();
  };
  for (const AskedAccuracy& asked : {AskedAccuracy{}, {5e-3, 10.0}, {10.0, 0.5 * kDegree}}) {
    std::vector<int> measured;
    SetPoint at{plan->start_pose, plan->start_tension_N};
    std::set<int> left{0, 1, 2, 3, 4, 5, 6, 7};
    while (!left.empty()) {
      const double now = weighted_trace(dense_covariance(robot, *plan, measured), asked);
      const auto next = chooser.choose(measured, plan->start_pose, plan->start_tension_N, asked);
      ASSERT_TRUE(next);
      ASSERT_EQ(left.count(next->stop), 1U);
      const auto gain_of = [&](int stop) {
        std::vector<int> with = measured;
        with.push_back(stop);
        return std::log(now / weighted_trace(dense_covariance(robot, *plan, with), asked)) /
               time_s(at, place(plan->poses[stop]));
      };
      const double gain = gain_of(next->stop);
      EXPECT_GT(gain, 0.0);
      for (const int other : left) EXPECT_LE(gain_of(other), gain * (1.0 + 1e-6)) << other;
      EXPECT_NEAR(next->time_s, time_s(at, place(plan->poses[next->stop])), 1e-9);
      measured.push_back(next->stop);
      left.erase(next->stop);
      at = place(plan->poses[next->stop]);
      const Vector6 promised = dense_covariance(robot, *plan, measured).diagonal().cwiseSqrt();
      for (int i = 0; i < 6; ++i) {
        EXPECT_NEAR(next->predicted_deviation[i], promised[i], 1e-5 * promised[i]);
      }
    }
    // All are measured.
    EXPECT_FALSE(chooser.choose(measured, plan->start_pose, plan->start_tension_N, asked));
  }
}

TEST_F(NextStops, TheWayIsThatOfAStartUp) {
  const NextStopChooser chooser(robot, *plan, 2);
  const auto first = chooser.choose({}, plan->start_pose, plan->start_tension_N, AskedAccuracy{});
  ASSERT_TRUE(first);
  ASSERT_EQ(first->way.setpoint_N.size(), 1U);
  EXPECT_EQ(first->way.setpoint_N[0], plan->poses[first->stop].tension_N);
  EXPECT_EQ(first->way.via, std::vector<bool>{false});
  // A start-up takes it as the rest of its plan.
  StartUp startup(robot, {{plan->start_tension_N}, {}, {}, {}});
  EXPECT_NO_THROW(startup.go_on_with(first->way));
  EXPECT_EQ(startup.transition_s(1), first->way.transition_s[0]);
}

TEST_F(NextStops, PassThroughAnotherPlaceWhereNoDirectWayIsClear) {
  // The direct way between these two sags through the floor (path_test), so it goes by the start.
  PlanOptions options;
  options.positions_m = {{-0.6, -0.66, 0.4375}, {0.6, 0.66, 0.1}};
  options.home_m = Vector3(0.0, 0.0, 0.9);
  options.set_points.tension_margin_N = 0.0;
  const Plan made = plan_for(robot, options);
  ASSERT_EQ(made.poses.size(), 3U);
  ASSERT_FALSE(made.poses[1].measured);
  const NextStopChooser chooser(robot, made);
  const auto next = chooser.choose({0}, made.start_pose, made.start_tension_N, AskedAccuracy{});
  ASSERT_TRUE(next) << "what the plan reaches is reached here too";
  EXPECT_EQ(next->stop, 2);
  ASSERT_EQ(next->way.setpoint_N.size(), 2U);
  EXPECT_EQ(next->way.via, (std::vector<bool>{true, false}));
  EXPECT_EQ(next->way.setpoint_N[0], made.start_tension_N);
  EXPECT_EQ(next->way.setpoint_N[1], made.poses[2].tension_N);
  EXPECT_EQ(next->way.transition_s,
            (std::vector<double>{made.poses[1].transition_s, made.poses[2].transition_s}));
  EXPECT_NEAR(next->time_s,
              made.poses[1].transition_s + made.poses[1].dwell_s + made.poses[2].transition_s +
                  made.poses[2].dwell_s,
              1e-9);
  // A place to pass through is none to measure.
  EXPECT_THROW((void)chooser.choose({1}, made.start_pose, made.start_tension_N, {}), InputError);
}

TEST_F(NextStops, ABiasOfTheLoadCellsChangesTheReadingsAndNothingElse) {
  const CableVector bias_N = Eigen::Vector4d(5.0, -3.0, 0.0, 8.0);
  const Robot biased = irma4_listing({{"load_cell_bias", "", {{"bias_N", {5.0, -3.0, 0.0, 8.0}}}}});
  Plan read = *plan;
  read.start_tension_N += bias_N;
  for (PlannedPose& stop : read.poses) stop.tension_N += bias_N;
  const NextStopChooser plain(robot, *plan), with_bias(biased, read);
  std::vector<int> measured;
  for (int i = 0; i < 3; ++i) {
    const auto a = plain.choose(measured, plan->start_pose, plan->start_tension_N, {});
    const auto b = with_bias.choose(measured, read.start_pose, read.start_tension_N, {});
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->stop, b->stop);
    EXPECT_NEAR(a->time_s, b->time_s, 1e-6);
    EXPECT_LT((a->predicted_deviation - b->predicted_deviation).norm(), 1e-8);
    ASSERT_EQ(b->way.setpoint_N.size(), 1U);
    EXPECT_EQ(b->way.setpoint_N[0], read.poses[b->stop].tension_N) << "what the load cells read";
    measured.push_back(a->stop);
  }
}

TEST_F(NextStops, AreNoneWhenStoppedOrWithoutMeasuredPoses) {
  const NextStopChooser stopped(robot, *plan, 1, [](double) { return false; });
  EXPECT_TRUE(stopped.stopped());
  EXPECT_FALSE(stopped.choose({}, plan->start_pose, plan->start_tension_N, {}));
  Plan empty = *plan;
  for (PlannedPose& stop : empty.poses) stop.measured = false;
  const NextStopChooser nothing(robot, empty);
  EXPECT_FALSE(nothing.stopped());
  EXPECT_FALSE(nothing.choose({}, plan->start_pose, plan->start_tension_N, {}));
}

std::string refusal(const Robot& robot, const Plan& plan) {
  return test::refusal_of([&] { NextStopChooser{robot, plan, 1}; });
}

TEST_F(NextStops, RefuseAPlanThatDoesNotFitTheRobot) {
  EXPECT_THAT(refusal(load_robot("ring5"), *plan),
              HasSubstr("the start has 4 tensions; ring5 has 5 cables"));
  Plan odd = *plan;
  odd.poses[2].tension_N = CableVector::Constant(3, 100.0);
  EXPECT_THAT(refusal(robot, odd), HasSubstr("stop 3 has 3 tensions"));
  Plan strong = *plan;
  strong.poses[4].tension_N[1] = 500.0;
  EXPECT_THAT(refusal(robot, strong), HasSubstr("a tension of stop 5 is beyond the limits"));
  Plan loose = *plan;
  loose.poses[1].tension_N.setConstant(21.0);
  EXPECT_THAT(refusal(robot, loose), HasSubstr("stop 2: its tensions do not hold the platform"));
  // What counts is what the cables carry: 26 N each are still too few, 1 N is below the limit.
  const auto biased = [](double by_N) {
    return irma4_listing({{"load_cell_bias", "", {{"bias_N", {by_N, by_N, by_N, by_N}}}}});
  };
  loose.poses.erase(loose.poses.begin());
  for (PlannedPose& stop : loose.poses) stop.tension_N.setConstant(21.0);
  loose.start_tension_N.setConstant(21.0);
  EXPECT_THAT(refusal(biased(-5.0), loose), HasSubstr("the start: its tensions do not hold"));
  EXPECT_THAT(refusal(biased(20.0), loose), HasSubstr("a tension of the start is beyond"));
  EXPECT_EQ(refusal(robot, *plan), "accepted");
}

TEST_F(NextStops, RefuseWhatWasNotToBeMeasured) {
  const NextStopChooser chooser(robot, *plan);
  for (const int stop : {-1, 8}) {
    try {
      (void)chooser.choose({stop}, plan->start_pose, plan->start_tension_N, {});
      ADD_FAILURE() << stop;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("pose " + std::to_string(stop + 1) + " of the plan"));
    }
  }
}

TEST(NextStop, ByWorthIsTheMostPerSecondOfWhatIsWorthAnything) {
  const Robot robot = load_robot("irma4");
  const Plan plan = plan_for(robot);
  const NextStopChooser chooser(robot, plan);
  std::vector<int> stops;
  for (std::size_t i = 0; i < plan.poses.size(); ++i) {
    if (plan.poses[i].measured) stops.push_back(static_cast<int>(i));
  }
  const auto only = [&](int stop, double nats) {
    std::vector<double> worth(plan.poses.size(), 0.0);
    worth[static_cast<std::size_t>(stop)] = nats;
    return worth;
  };
  EXPECT_FALSE(chooser.choose({}, std::vector<double>(plan.poses.size(), 0.0)));
  EXPECT_FALSE(chooser.choose({stops[0]}, only(stops[0], 5.0))) << "it was measured";
  const auto near = chooser.choose({stops[0]}, only(stops[1], 1.0));
  const auto far = chooser.choose({stops[0]}, only(stops.back(), 1.0));
  ASSERT_TRUE(near && far);
  EXPECT_EQ(near->stop, stops[1]);
  EXPECT_FALSE(near->way.setpoint_N.empty());
  EXPECT_TRUE(near->predicted_deviation.array().isNaN().all());
  // The rates decide, not the worth.
  std::vector<double> both = only(stops[1], near->time_s);
  both[static_cast<std::size_t>(stops.back())] = 1.01 * far->time_s;
  EXPECT_EQ(chooser.choose({stops[0]}, both)->stop, stops.back());
  both[static_cast<std::size_t>(stops.back())] = 0.99 * far->time_s;
  EXPECT_EQ(chooser.choose({stops[0]}, both)->stop, stops[1]);
}

}  // namespace
}  // namespace cdprcal
