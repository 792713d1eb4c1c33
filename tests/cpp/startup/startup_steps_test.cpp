// The start-up procedure step by step: ended early, sent elsewhere, disturbed, used wrongly.
#include <gmock/gmock.h>

#include "../support/startup_scenario.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/statics/natural_frequencies.hpp"
#include "support/refusal.hpp"

namespace cdprcal::test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// How a run came to a stop.
struct Stop {
  double took_s = 0.0, setpoint_rests_s = 0.0;
  double least_N = HUGE_VAL, most_N = 0.0, most_before_N = 0.0;
};

/// A start-up and its simulated robot, a hundredth of a second at a time.
class SteppedRun {
 public:
  explicit SteppedRun(const Robot& robot, const StartUpPlan& plan,
                      const StartUpOptions& options = {})
      : startup(robot, plan, options), simulator(robot) {
    const RestResult rest = simulator.reset(plan.setpoint_N.front());
    if (!rest.found) throw std::runtime_error(rest.reason);
  }

  const StartUpCommand& tick() {
    RobotSample sample = simulator.read();
    sample.drive_error = drive_error;
    if (dead_cell >= 0) sample.tension_N[dead_cell] = kNaN;
    const StartUpCommand& command = startup.step(sample);
    if (command.locked) {
      simulator.hold();
    } else {
      simulator.command_each(command.velocity_m_s, command.tension_setpoint_N, command.by_tension);
    }
    simulator.advance(0.01);
    return command;
  }

  /// Until the run is in `state` at a set-point, or has ended.
  void until(StartUpState state, int setpoint) {
    for (int i = 0; i < 20000 && !startup.finished(); ++i) {
      const StartUpCommand& command = tick();
      if (command.state == state && command.setpoint == setpoint) return;
    }
    ADD_FAILURE() << "not reached: " << to_string(state) << " " << setpoint << ", but "
                  << to_string(startup.state()) << " " << startup.reason();
  }

  /// To the end; where the platform was when the first measurement of each set-point was half over.
  std::vector<Pose> to_the_end() {
    std::vector<Pose> poses;
    double since_s = kNaN;
    for (int i = 0; i < 40000 && !startup.finished(); ++i) {
      const StartUpCommand& command = tick();
      const bool measuring = command.state == StartUpState::measuring;
      since_s = !measuring ? kNaN : std::isnan(since_s) ? simulator.time_s() : since_s;
      if (std::abs(simulator.time_s() - since_s - 0.5) < 0.005) {
        poses.push_back(simulator.truth().pose);
      }
    }
    return poses;
  }

  /// Until the winches are locked, and two seconds more.
  Stop to_a_stop() {
    Stop stop;
    stop.most_before_N = simulator.truth().tension_N.maxCoeff();
    const double begin_s = simulator.time_s();
    CableVector setpoint_N;
    for (int locked = 0; locked < 200; locked += startup.finished() ? 1 : 0) {
      const double now_s = simulator.time_s() - begin_s;
      const StartUpCommand& command = tick();
      if (setpoint_N.size() == 0 || command.tension_setpoint_N != setpoint_N) {
        stop.setpoint_rests_s = now_s;
      }
      setpoint_N = command.tension_setpoint_N;
      if (!startup.finished()) stop.took_s = now_s;
      const CableVector tension_N = simulator.truth().tension_N;
      stop.least_N = std::min(stop.least_N, tension_N.minCoeff());
      stop.most_N = std::max(stop.most_N, tension_N.maxCoeff());
    }
    return stop;
  }

  StartUp startup;
  Simulator simulator;
  std::string drive_error;  ///< what the samples say from now on
  int dead_cell = -1;
};

class StartUpSteps : public ::testing::Test {
 protected:
  const Robot robot = load_robot("irma4");
  const StartUpPlan all = irma4_plan();
  /// Set-points of `all`.
  [[nodiscard]] StartUpPlan only(const std::vector<std::size_t>& which) const {
    StartUpPlan plan;
    for (const std::size_t k : which) plan.setpoint_N.push_back(all.setpoint_N[k]);
    return plan;
  }
  void expect_at(const Pose& pose, std::size_t setpoint) const {
    const EquilibriumResult rest = direct_from_tensions(robot, all.setpoint_N[setpoint], pose);
    EXPECT_EQ(rest.status, EquilibriumStatus::found);
    // The load cells' own noise alone moves a platform on constant tensions by millimetres.
    EXPECT_LT(minus(pose, rest.pose).head<3>().norm(), 5e-3) << setpoint;
  }
};

TEST_F(StartUpSteps, EndsEarlyWhereItIsWhenThatIsEnough) {
  SteppedRun run(robot, only({0, 1, 2}));
  run.until(StartUpState::moving, 1);
  for (int i = 0; i < 150; ++i) run.tick();  // in full motion
  ASSERT_EQ(run.startup.state(), StartUpState::moving);
  run.startup.finish();
  EXPECT_EQ(run.startup.state(), StartUpState::done);
  EXPECT_FALSE(run.startup.finished()) << "the winches still run";
  const Stop stop = run.to_a_stop();
  EXPECT_LE(stop.took_s, 5.0);
  EXPECT_LE(stop.setpoint_rests_s, 0.2 + 1e-9);
  EXPECT_GT(stop.took_s, 0.2) << "not at once: it moved";
  // Nothing falls slack or is caught, neither in the stop nor on locked winches.
  EXPECT_GT(stop.least_N, 0.5 * robot.tension_min_N);
  EXPECT_LT(stop.most_N, 1.5 * stop.most_before_N);
  const StartUpCommand& command = run.tick();
  EXPECT_TRUE(command.locked);
  EXPECT_EQ(command.remaining_s, 0.0);
  EXPECT_EQ(run.startup.reason(), "");
  ASSERT_EQ(run.startup.rests().size(), 1U);
  // A run that has ended stays as it ended.
  run.startup.finish();
  EXPECT_EQ(run.startup.state(), StartUpState::done);
  EXPECT_THAT([&] { run.startup.go_on_with(only({1})); },
              ThrowsMessage<InputError>(HasSubstr("the run has ended; start another")));
}

TEST_F(StartUpSteps, WithoutTrustInLoadCellsTheWinchesStopTogetherWithin200Milliseconds) {
  SteppedRun run(robot, only({0, 1, 2}));
  run.until(StartUpState::moving, 1);
  for (int i = 0; i < 150; ++i) run.tick();
  run.drive_error = "drive 2 is hot";
  CableVector before = run.tick().velocity_m_s;
  ASSERT_EQ(run.startup.state(), StartUpState::holding);
  ASSERT_GT(before.norm(), 0.01);
  int steps = 1;
  for (; !run.startup.finished(); ++steps) {
    ASSERT_LE(steps, 20);
    const StartUpCommand& command = run.tick();
    EXPECT_THAT(command.by_tension, ::testing::Each(false));
    const CableVector now = command.velocity_m_s;
    EXPECT_LT(now.norm(), before.norm());
    EXPECT_LT((now - now.norm() / before.norm() * before).norm(), 1e-12) << "by one share";
    before = now;
  }
}

TEST_F(StartUpSteps, AtRestAnEndLocksTheWinchesAtOnce) {
  SteppedRun run(robot, only({0, 1}));
  run.until(StartUpState::measuring, 0);
  run.startup.finish();
  EXPECT_TRUE(run.tick().locked);
}

TEST_F(StartUpSteps, ALoadCellThatDiesDuringAStopIsNotFollowed) {
  SteppedRun run(robot, only({0, 1, 2}));
  run.until(StartUpState::moving, 1);
  for (int i = 0; i < 150; ++i) run.tick();
  run.startup.finish();
  for (int i = 0; i < 10; ++i) run.tick();
  EXPECT_THAT(run.tick().by_tension, ::testing::Each(true));
  run.dead_cell = 2;
  EXPECT_THAT(run.tick().by_tension, ::testing::Each(true)) << "one missing sample is no fault";
  run.dead_cell = -1;
  for (int i = 0; i < 10; ++i) run.tick();
  EXPECT_FALSE(run.startup.finished());
  run.dead_cell = 2;
  for (int i = 0; i < 16; ++i) run.tick();
  EXPECT_THAT(run.tick().by_tension, ::testing::Each(false));
  for (int i = 0; i < 20; ++i) run.tick();
  EXPECT_TRUE(run.startup.finished());
}

TEST_F(StartUpSteps, AStopForAReasonIsNoEndThatWasWished) {
  SteppedRun run(robot, only({0, 1}));
  run.until(StartUpState::settling, 0);
  RobotSample sample = run.simulator.read();
  sample.stop_requested = true;
  EXPECT_TRUE(std::isnan(run.startup.step(sample).remaining_s)) << "nobody knows when it goes on";
  run.startup.finish();
  EXPECT_EQ(run.startup.state(), StartUpState::holding);
  EXPECT_EQ(run.startup.reason(), "stopped by the operator");
  EXPECT_THAT([&] { run.startup.go_on_with(only({1})); },
              ThrowsMessage<InputError>(HasSubstr("the run has ended")));
}

TEST_F(StartUpSteps, WithAClockThatStandsTheWinchesStopAtOnce) {
  SteppedRun run(robot, only({0, 1}));
  run.until(StartUpState::moving, 1);
  for (int i = 0; i < 150; ++i) run.tick();
  RobotSample sample = run.simulator.read();
  run.startup.step(sample);
  EXPECT_GT(run.startup.step(sample).velocity_m_s.norm(), 0.0);
  run.startup.finish();
  const StartUpCommand& command = run.startup.step(sample);  // no time has passed
  EXPECT_TRUE(command.velocity_m_s.isZero(0.0));
  EXPECT_TRUE(run.startup.finished());
}

TEST_F(StartUpSteps, GoesOnWithOtherStopsAfterTheOneItMovesTo) {
  SteppedRun run(robot, only({0, 1, 2, 3}));
  run.until(StartUpState::moving, 1);
  StartUpPlan rest = only({5, 1, 7});
  rest.transition_s = {0.0, 7.5, 0.0};
  rest.via = {false, true, false};
  run.startup.go_on_with(rest);
  // As if planned so from the beginning.
  StartUpPlan planned = only({0, 1, 5, 1, 7});
  planned.transition_s = {0.0, 0.0, 0.0, 7.5, 0.0};
  const StartUp anew(robot, planned);
  for (std::size_t k = 1; k < 5; ++k) {
    EXPECT_NEAR(run.startup.transition_s(k), anew.transition_s(k), 1e-6) << k;
  }
  const std::vector<Pose> poses = run.to_the_end();
  ASSERT_EQ(run.startup.state(), StartUpState::done) << run.startup.reason();
  std::vector<int> measured;
  for (const StartUpRest& one : run.startup.rests()) measured.push_back(one.setpoint);
  EXPECT_EQ(measured, (std::vector<int>{0, 1, 2, 4})) << "the fourth is only passed";
  ASSERT_EQ(poses.size(), 3U);
  expect_at(poses[0], 1);
  expect_at(poses[1], 5);
  expect_at(poses[2], 7);
}

TEST_F(StartUpSteps, WithNothingToGoOnWithThePresentStopIsTheLast) {
  SteppedRun run(robot, only({0, 1, 2, 3}));
  run.until(StartUpState::moving, 1);
  run.startup.go_on_with({});
  run.to_the_end();
  EXPECT_EQ(run.startup.state(), StartUpState::done);
  EXPECT_EQ(run.startup.rests().size(), 2U);
}

TEST_F(StartUpSteps, StopsThatAreRefusedChangeNothing) {
  SteppedRun run(robot, only({0, 1}));
  run.until(StartUpState::settling, 0);
  const double planned_s = run.startup.planned_duration_s();
  StartUpPlan rest = only({2, 3});
  rest.setpoint_N[1].setConstant(22.0);  // cannot carry the platform
  EXPECT_THAT([&] { run.startup.go_on_with(rest); },
              ThrowsMessage<InputError>(HasSubstr("on the way to set-point 2 of the rest")));
  rest.setpoint_N[1].setConstant(401.0);
  EXPECT_THAT([&] { run.startup.go_on_with(rest); },
              ThrowsMessage<InputError>(HasSubstr("set-point 2: a tension is outside")));
  EXPECT_EQ(run.startup.planned_duration_s(), planned_s);
  const std::vector<Pose> poses = run.to_the_end();
  EXPECT_EQ(run.startup.state(), StartUpState::done) << run.startup.reason();
  ASSERT_EQ(run.startup.rests().size(), 2U);
  ASSERT_EQ(poses.size(), 2U);
  expect_at(poses[1], 1);
}

TEST_F(StartUpSteps, WhatMovesAgainWhileItIsMeasuredIsMeasuredAnew) {
  SteppedRun run(robot, only({0, 1}));
  run.until(StartUpState::measuring, 0);
  for (int i = 0; i < 30; ++i) run.tick();
  ASSERT_EQ(run.startup.state(), StartUpState::measuring);
  const double knock_s = run.simulator.time_s();
  run.simulator.push({0.1, 0.15, 0.0}, {0.3, 0.2, 0.3});
  run.until(StartUpState::settling, 0);
  EXPECT_LT(run.simulator.time_s() - knock_s, 0.5);
  run.to_the_end();
  ASSERT_EQ(run.startup.state(), StartUpState::done) << run.startup.reason();
  ASSERT_EQ(run.startup.rests().size(), 2U);
  EXPECT_GT(run.startup.rests()[0].begin_s, knock_s) << "nothing from before the knock counts";
}

/// What the sensors say of a robot that hangs still under these tensions.
RobotSample still(double time_s, const CableVector& tension_N) {
  RobotSample sample;
  sample.time_s = time_s;
  sample.length_m = CableVector::Constant(tension_N.size(), 1.0);
  sample.tension_N = tension_N;
  return sample;
}

TEST_F(StartUpSteps, WhatIsRecordedIsKeptWithinTheLimits) {
  StartUp startup(robot, only({0}));
  const CableVector found_N = Eigen::Vector4d(410.0, 12.0, 100.0, 90.0);
  const StartUpCommand& command = startup.step(still(0.0, found_N));
  EXPECT_EQ(command.state, StartUpState::recording);
  EXPECT_TRUE(command.locked);
  EXPECT_EQ(command.tension_setpoint_N, CableVector(Eigen::Vector4d(400.0, 20.0, 100.0, 90.0)));
  EXPECT_NEAR(command.remaining_s, startup.planned_duration_s(), 1e-9);
}

TEST_F(StartUpSteps, FromASupportItMovesNoFasterThanThePlatformAtTheStartSwings) {
  // All tensions together carry less than the platform weighs: there is no equilibrium to come
  // from, and the time of the first transition is a period and a half of the slowest mode at τ0.
  StartUp startup(robot, only({0, 1}));
  const CableVector slack_N = CableVector::Constant(4, 24.0);
  for (int i = 0;
       startup.state() == StartUpState::idle || startup.state() == StartUpState::recording; ++i) {
    ASSERT_LT(i, 200);
    startup.step(still(0.01 * i, slack_N + 0.1 * CableVector::Constant(4, i % 2)));
  }
  EXPECT_EQ(startup.state(), StartUpState::moving_to_start);
  const EquilibriumResult rest = direct_from_tensions(robot, all.setpoint_N[0]);
  const PlatformState state = platform_state(robot, rest.pose);
  const double slowest_hz =
      constant_tension_modes(robot, state, all.setpoint_N[0]).natural_frequency_hz.minCoeff();
  EXPECT_NEAR(startup.transition_s(0), 1.5 / slowest_hz, 1e-6);
}

TEST(StartUpState, HasANameForPeople) {
  using enum StartUpState;
  const std::vector<std::pair<StartUpState, std::string>> names{
      {idle, "idle"},     {recording, "recording"}, {moving_to_start, "moving_to_start"},
      {moving, "moving"}, {settling, "settling"},   {measuring, "measuring"},
      {done, "done"},     {holding, "holding"}};
  for (const auto& [state, name] : names) EXPECT_EQ(to_string(state), name);
}

TEST_F(StartUpSteps, EachWrongOptionIsRefusedByName) {
  const auto refusal = [&](auto change) -> std::string {
    StartUpOptions options;
    change(options);
    return refusal_of([&] { StartUp{robot, only({0}), options}; });
  };
  using O = StartUpOptions;
  EXPECT_EQ(refusal([](O&) {}), "accepted");
  const std::string times = "start-up options: times must not be negative";
  EXPECT_EQ(refusal([](O& o) { o.record_s = -1.0; }), times);
  EXPECT_EQ(refusal([](O& o) { o.measure_s = -1.0; }), times);
  EXPECT_EQ(refusal([](O& o) { o.settle_timeout_s = kNaN; }), times);
  EXPECT_EQ(refusal([](O& o) { o.velocity_limit_m_s = -0.1; }),
            "start-up options: velocity_limit_m_s must not be negative");
  const std::string control = "start-up options: control values must be positive";
  EXPECT_EQ(refusal([](O& o) { o.control.bandwidth = 0.0; }), control);
  EXPECT_EQ(refusal([](O& o) { o.control.filter = 0.0; }), control);
  EXPECT_EQ(refusal([](O& o) { o.control.direction_error = -0.01; }), control);
  EXPECT_EQ(refusal([](O& o) { o.control.axial_stiffness_N = kNaN; }), control);
  EXPECT_THAT(refusal([](O& o) { o.rest.window_s = 0.0; }), HasSubstr("options: rest:"));
  EXPECT_THAT(refusal([](O& o) { o.rest.confidence = 0.0; }), HasSubstr("options: rest:"));
  EXPECT_THAT(refusal([](O& o) { o.rest.confidence = 1.0; }), HasSubstr("options: rest:"));
  EXPECT_THAT(refusal([](O& o) { o.rest.tolerance = -1.0; }), HasSubstr("options: rest:"));
}

TEST_F(StartUpSteps, EachWrongPlanIsRefusedByName) {
  const auto refusal = [&](const StartUpPlan& plan) -> std::string {
    return refusal_of([&] { StartUp{robot, plan}; });
  };
  EXPECT_EQ(refusal({}), "start-up plan: no set-points; give at least one");
  StartUpPlan plan = only({0, 1});
  plan.setpoint_N[1][2] = kNaN;
  EXPECT_EQ(refusal(plan), "start-up plan: set-point 2: give 4 finite tensions, one a cable");
  plan.setpoint_N[1][2] = 500.0;
  EXPECT_EQ(refusal(plan),
            "start-up plan: set-point 2: a tension is outside the robot's limits; give one within");
  plan.setpoint_N[1] = CableVector::Constant(4, 22.0);
  EXPECT_THAT(refusal(plan), HasSubstr("no stable equilibrium on the way to set-point 2: "));
  EXPECT_THAT(refusal(plan), HasSubstr("make a plan with cdprcal plan"));
  plan = only({0, 1});
  plan.transition_s = {1.0};
  EXPECT_EQ(refusal(plan), "start-up plan: give as many transition times as set-points, or none");
  for (const double wrong_s : {-1.0, kNaN, std::numeric_limits<double>::infinity()}) {
    plan.transition_s = {1.0, wrong_s};
    EXPECT_EQ(refusal(plan), "start-up plan: transition_s must be 0 or more");
  }
  plan.transition_s.clear();
  plan.via = {false};
  EXPECT_EQ(refusal(plan), "start-up plan: say of every set-point whether it is via, or of none");
}

}  // namespace
}  // namespace cdprcal::test
