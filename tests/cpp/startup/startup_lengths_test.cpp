// The start-up of six cables and more, led by lengths: on the plant, from where it was parked.
#include "../support/cells.hpp"
#include "cdprcal/equilibria/inverse.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/simulator/random_start.hpp"
#include "cdprcal/simulator/simulate_startup.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

#include <gtest/gtest.h>

namespace cdprcal::test {
namespace {

/// A way through a few poses; the last is turned, too.
StartUpPlan plan_of(const Robot& robot) {
  StartUpPlan plan;
  const InverseSolver solver(robot, {});
  const Vector3 middle = robot.name == "posts8" ? Vector3(0, 0, 1.2) : Vector3(0, 0, 1.5);
  for (const Vector3& off :
       {Vector3(0, 0, 0), Vector3(0.25, -0.2, 0.1), Vector3(-0.2, 0.15, -0.1)}) {
    const auto point = solver.solve(middle + off);
    EXPECT_EQ(point.status, EquilibriumStatus::found);
    plan.setpoint_N.push_back(point.tension_N);
    plan.pose.push_back({middle + off, point.rotation});
  }
  const Eigen::Quaterniond turned = exp_so3({0.03, -0.04, 0.05}) * plan.pose[0].rotation;
  const auto point = solver.continue_from(middle, turned);
  EXPECT_EQ(point.status, EquilibriumStatus::found);
  plan.setpoint_N.push_back(point.tension_N);
  plan.pose.push_back({middle, turned});
  return plan;
}

/// Pose of the plant in the middle of each measured rest.
std::vector<Pose> rest_poses(const StartUpRun& run) {
  std::vector<Pose> poses;
  for (const SampleRange& rows : run.rest_rows) {
    poses.push_back(run.truth[static_cast<std::size_t>((rows.begin + rows.end) / 2)].pose);
  }
  return poses;
}

TEST(StartUpByLengths, GoesFromPoseToPose) {
  for (const Robot& robot : {load_robot("posts8"), eight_cable_cell()}) {
    SCOPED_TRACE(robot.name);
    const StartUpPlan plan = plan_of(robot);
    for (const WinchMode mode : {WinchMode::tension, WinchMode::velocity}) {
      SCOPED_TRACE(mode == WinchMode::tension ? "loops in the drives" : "loops outside the drives");
      StartUpRunOptions options;
      options.simulator.winch.mode = mode;
      // As stiff as the procedure expects cables to be: what a loop at 100 Hz can hold.
      if (mode == WinchMode::velocity) options.simulator.strand.axial_stiffness_N = 1.5e5;
      const StartUpRun run = simulate_startup(robot, plan, options);
      ASSERT_EQ(run.state, StartUpState::done) << run.reason;
      const std::vector<Pose> at = rest_poses(run);
      ASSERT_EQ(at.size(), plan.pose.size());
      const double elastic_m = mode == WinchMode::velocity ? 5e-3 : 1e-4;
      for (std::size_t k = 0; k < at.size(); ++k) {
        EXPECT_LT((at[k].position_m - plan.pose[k].position_m).norm(), elastic_m);
        EXPECT_LT(rotation_distance_rad(at[k], plan.pose[k]), elastic_m / 0.2);
      }
      EXPECT_LT(run.max_tension_N, robot.tension_max_N);
    }
  }
}

TEST(StartUpByLengths, FromWhereItWasParkedAllPosesAreMovedAlike) {
  for (const Robot& robot : {load_robot("posts8"), eight_cable_cell()}) {
    const StartUpPlan plan = plan_of(robot);
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      SCOPED_TRACE(robot.name + ", seed " + std::to_string(seed));
      const auto start = parked_start(robot, plan.pose[0], seed);
      ASSERT_TRUE(start);
      const double off_m = (start->pose.position_m - plan.pose[0].position_m).norm();
      EXPECT_LE(off_m, std::sqrt(3.0) * kParked * robot_size_m(robot));
      StartUpRunOptions options;
      options.initial_pose = start->pose;
      options.simulator.seed = seed;
      const StartUpRun run = simulate_startup(robot, plan, options);
      ASSERT_EQ(run.state, StartUpState::done) << run.reason;
      EXPECT_LT(minus(run.truth.front().pose, start->pose).norm(), 1e-6) << "nothing moves it";
      for (const PlantTruth& truth : run.truth) {
        EXPECT_GT(truth.tension_N.minCoeff(), 0.2 * robot.tension_min_N) << "slack";
        EXPECT_LT(truth.tension_N.maxCoeff(), robot.tension_max_N);
      }
      const std::vector<Pose> at = rest_poses(run);
      for (std::size_t k = 0; k < at.size(); ++k) {
        // Lengths are the same from another pose: the way is turned and bent by as much.
        EXPECT_LT((at[k].position_m - plan.pose[k].position_m).norm(), 3.0 * off_m + 0.05);
      }
    }
  }
}

TEST(StartUpByLengths, AStopInMotionOverloadsNoCable) {
  for (const char* name : {"posts8", "belts4", "hang4"}) {
    SCOPED_TRACE(name);
    const Robot robot = load_robot(name);
    StartUpPlan plan;
    for (const SyntheticStop& stop : default_stops(robot, 2, 2, 2)) {
      plan.setpoint_N.push_back(stop.tension_N);
      plan.pose.push_back(stop.pose);
    }
    const StartUp whole(robot, plan);
    ASSERT_GE(plan.pose.size(), 4U);
    for (const int leg : {1, 2, 3}) {
      for (const double share : {0.3, 0.5, 0.7}) {
        SCOPED_TRACE(std::to_string(leg) + " " + std::to_string(share));
        StartUpRunOptions options;
        options.log_rate_Hz = 100.0;
        double began_s = kNaN;
        options.progress = [&](const StartUpCommand& command, const RobotSample& sample) {
          if (command.setpoint != leg || command.state != StartUpState::moving) return true;
          if (std::isnan(began_s)) began_s = sample.time_s;
          const double last_s = whole.transition_s(static_cast<std::size_t>(leg));
          return sample.time_s - began_s < share * last_s;
        };
        const StartUpRun run = simulate_startup(robot, plan, options);
        EXPECT_EQ(run.state, StartUpState::holding);
        EXPECT_LT(run.max_tension_N, robot.tension_max_N);
      }
    }
  }
}

TEST(StartUpByLengths, TensionsFollowTheirSetPointsWhereTheyAreTold) {
  const Robot robot = load_robot("posts8");
  const StartUpPlan plan = plan_of(robot);
  StartUpRunOptions options;
  options.initial_pose = parked_start(robot, plan.pose[0], 3)->pose;
  std::vector<bool> told;
  options.progress = [&](const StartUpCommand& command, const RobotSample&) {
    told = command.by_tension;
    return true;
  };
  const StartUpRun run = simulate_startup(robot, plan, options);
  ASSERT_EQ(run.state, StartUpState::done) << run.reason;
  EXPECT_EQ(std::count(told.begin(), told.end(), true), 2);
  for (std::size_t k = 0; k < run.rest_rows.size(); ++k) {
    const SampleRange& rows = run.rest_rows[k];
    for (Eigen::Index i = 0; i < 8; ++i) {
      if (!told[static_cast<std::size_t>(i)]) continue;
      const CableVector& truth = run.truth[static_cast<std::size_t>(rows.end - 1)].tension_N;
      EXPECT_NEAR(truth[i], plan.setpoint_N[k][i], 1.0);
    }
  }
}

TEST(StartUpByLengths, PosesDoNotLeadWhatTensionsLead) {
  const Robot robot = load_robot("irma4");
  StartUpPlan plan;
  plan.setpoint_N.emplace_back(CableVector::Constant(4, 80.0));
  const StartUp without(robot, plan);
  plan.pose.emplace_back();  // nowhere near
  const StartUp with(robot, plan);
  EXPECT_EQ(with.planned_duration_s(), without.planned_duration_s());
}

TEST(StartUpByLengths, RefusesWhatCannotBe) {
  const Robot robot = load_robot("posts8");
  const StartUpPlan plan = plan_of(robot);
  StartUpPlan short_of_one = plan;
  short_of_one.pose.pop_back();
  EXPECT_THROW(StartUp(robot, short_of_one), InputError);
  StartUpRunOptions torque;
  torque.simulator.winch.mode = WinchMode::torque;
  EXPECT_THROW((void)simulate_startup(robot, plan, torque), InputError);
  StartUp startup(robot, plan);
  StartUpPlan rest;
  rest.setpoint_N = {plan.setpoint_N[1]};
  EXPECT_THROW(startup.go_on_with(rest), InputError) << "no poses";
  rest.pose = {plan.pose[1]};
  EXPECT_NO_THROW(startup.go_on_with(rest));
}

}  // namespace
}  // namespace cdprcal::test
