// The start-up procedure on the simulated robot: it ends, within its limits, at rest.
#include "../support/startup_scenario.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal::test {
namespace {

void expect_within_limits(const Robot& robot, const StartUpRun& run, const StartUpPlan& plan) {
  EXPECT_GE(run.min_setpoint_N, robot.tension_min_N);
  EXPECT_LE(run.max_setpoint_N, robot.tension_max_N);
  EXPECT_LE(run.max_velocity_m_s, StartUp(robot, plan).velocity_limit_m_s() * (1.0 + 1e-12));
}

void expect_rests(const Robot& robot, const StartUpRun& run, const StartUpPlan& plan) {
  ASSERT_EQ(run.state, StartUpState::done) << run.reason;
  ASSERT_EQ(run.rests.size(), plan.setpoint_N.size());
  for (const RestError& error : rest_errors(robot, plan, run)) {
    EXPECT_LT(error.position_m, 1e-3);
    EXPECT_LT(error.rotation_rad, 0.1 * kDegree);
  }
}

/// Tensions at power-on: a set-point-like vector, at random within the robot's stable tensions.
std::optional<CableVector> random_start(const Robot& robot, const Vector3& lower_m,
                                        const Vector3& upper_m, RandomNormal& random) {
  const Vector3 fraction(random.uniform(), random.uniform(), random.uniform());
  InverseOptions options;
  options.stability = StabilityNotion::constant_tensions;
  const InverseResult at =
      inverse(robot, lower_m + fraction.cwiseProduct(Vector3(upper_m - lower_m)), options);
  if (at.status != EquilibriumStatus::found) return std::nullopt;
  return at.tension_N;
}

TEST(StartUpRun, RandomStartsEndAtRestWithinTheLimits) {
  const Robot robot = load_robot("irma4");
  const char* many = std::getenv("CDPRCAL_MANY_STARTS");
  const int starts = many != nullptr ? std::atoi(many) : 10;
  RandomNormal random(2025);
  for (int i = 0; i < starts; ++i) {
    SCOPED_TRACE("start " + std::to_string(i));
    // Two set-points, drawn as well: many starts, not many times the same run.
    StartUpPlan plan;
    std::optional<CableVector> initial;
    while (plan.setpoint_N.size() < 3) {
      const auto at = random_start(robot, {-0.45, -0.45, 0.55}, {0.45, 0.45, 1.25}, random);
      if (!at) continue;
      if (!initial)
        initial = at;
      else
        plan.setpoint_N.push_back(*at);
      try {
        if (!plan.setpoint_N.empty()) StartUp(robot, plan);
      } catch (const InputError&) {
        plan.setpoint_N.pop_back();  // no stable way between the two
      }
    }
    StartUpRunOptions options;
    options.initial_tension_N = *initial;
    options.simulator.seed = static_cast<std::uint64_t>(i);
    const StartUpRun run = simulate_startup(robot, plan, options);
    expect_rests(robot, run, plan);
    expect_within_limits(robot, run, plan);
    EXPECT_LT(run.max_tension_N, robot.tension_max_N);
  }
}

TEST(StartUpRun, EightPosesTakeLessThanEightySecondsOnAnyRobot) {
  // Nothing is tuned: the same options for three robots of three, four and five cables.
  for (const Robot& robot : {load_robot("irma4"), ring_robot(3), ring_robot(5)}) {
    SCOPED_TRACE(robot.name);
    StartUpPlan plan = robot.name == "irma4" ? irma4_plan() : ring_plan(robot);
    plan.setpoint_N.erase(plan.setpoint_N.begin());  // eight poses, the first is τ₀
    const StartUpRun run = simulate_startup(robot, plan);
    expect_rests(robot, run, plan);
    expect_within_limits(robot, run, plan);
    EXPECT_LE(run.log.time_s[run.log.sample_count() - 1], 80.0);
    RecordProperty(robot.name + "_s", std::to_string(run.log.time_s[run.log.sample_count() - 1]));
  }
}

TEST(StartUpRun, WorksInTorqueModeAndOverAVelocityBus) {
  const Robot robot = load_robot("irma4");
  StartUpPlan plan = irma4_plan();
  plan.setpoint_N.resize(4);
  StartUpRunOptions options;
  options.simulator.winch.mode = WinchMode::torque;
  expect_rests(robot, simulate_startup(robot, plan, options), plan);
  // The controller's own loop at 100 Hz: cables of the whole range the catalogue calls typical.
  options.simulator.winch.mode = WinchMode::velocity;
  for (const double stiffness_N : {3e4, 1e5, 4e5}) {
    SCOPED_TRACE(stiffness_N);
    options.simulator.strand.axial_stiffness_N = stiffness_N;
    const StartUpRun run = simulate_startup(robot, plan, options);
    ASSERT_EQ(run.state, StartUpState::done) << run.reason;
    expect_within_limits(robot, run, plan);
    for (const RestError& error : rest_errors(robot, plan, run)) {
      EXPECT_LT(error.position_m, 3e-3);
      EXPECT_LT(error.rotation_rad, 0.3 * kDegree);
    }
  }
}

TEST(StartUpRun, RecordsWhatItDid) {
  const Robot robot = load_robot("irma4");
  StartUpPlan plan = irma4_plan();
  plan.setpoint_N.resize(2);
  StartUpRunOptions options;
  options.initial_tension_N = Eigen::Vector4d(90, 110, 95, 105);
  const StartUpRun run = simulate_startup(robot, plan, options);
  std::vector<StartUpState> states;
  for (const StartUpChange& change : run.changes) states.push_back(change.state);
  using enum StartUpState;
  EXPECT_EQ(states, (std::vector<StartUpState>{recording, moving_to_start, settling, measuring,
                                               moving, settling, measuring, done}));
  EXPECT_NO_THROW(validate(run.log));
  ASSERT_EQ(static_cast<std::size_t>(run.log.sample_count()), run.truth.size());
  EXPECT_NEAR(run.log.time_s[10], 1.0, 1e-9);  // 10 Hz
  // It starts at the tensions found, goes to τ₀ without a jump, and ends at the last set-point.
  EXPECT_LT((run.log.tension_setpoint_N.row(9).transpose() - options.initial_tension_N)
                .cwiseAbs()
                .maxCoeff(),
            1.5);
  // Nowhere faster than a fifth-degree transition of the larger leg: 15/8 of its mean rate.
  const CableVector change = plan.setpoint_N[1] - plan.setpoint_N[0];
  const double fastest_N_s =
      1.875 * change.cwiseAbs().maxCoeff() / StartUp(robot, plan).transition_s(1);
  for (Eigen::Index row = 11; row < run.log.sample_count(); ++row) {
    EXPECT_LT((run.log.tension_setpoint_N.row(row) - run.log.tension_setpoint_N.row(row - 1))
                  .cwiseAbs()
                  .maxCoeff(),
              1.001 * fastest_N_s * (run.log.time_s[row] - run.log.time_s[row - 1]));
  }
  EXPECT_EQ(CableVector(run.log.tension_setpoint_N.row(run.log.sample_count() - 1)),
            plan.setpoint_N[1]);
  // What was found on line is found again in the log.
  const auto again = detect_equilibria(run.log, {0, run.log.sample_count()}, robot.sigma);
  for (const StartUpRest& rest : run.rests) {
    EXPECT_TRUE(std::any_of(again.begin(), again.end(), [&](const Equilibrium& e) {
      return e.begin_s < rest.end_s && rest.begin_s < e.end_s;
    }));
  }
}

TEST(StartUpRun, PassesThroughSetpointsThatAreOnlyOnTheWay) {
  const Robot robot = load_robot("irma4");
  StartUpPlan plan = irma4_plan();
  plan.setpoint_N.resize(4);
  plan.via = {false, true, false, true};
  const StartUpRun run = simulate_startup(robot, plan);
  ASSERT_EQ(run.state, StartUpState::done) << run.reason;
  ASSERT_EQ(run.rests.size(), 2U);
  EXPECT_EQ(run.rests[0].setpoint, 0);
  EXPECT_EQ(run.rests[1].setpoint, 2);
  // It settles there all the same: the way on starts where it was planned from.
  const auto settled = [&](int setpoint) {
    return std::any_of(run.changes.begin(), run.changes.end(), [&](const StartUpChange& c) {
      return c.setpoint == setpoint && c.state == StartUpState::settling;
    });
  };
  EXPECT_TRUE(settled(1));
  EXPECT_TRUE(settled(3));
  expect_within_limits(robot, run, plan);
}

TEST(StartUpRun, ProgressCountsDownAndCanStop) {
  const Robot robot = load_robot("irma4");
  StartUpPlan plan = irma4_plan();
  plan.setpoint_N.resize(2);
  StartUpRunOptions options;
  double first_s = kNaN, last_s = kNaN;
  options.progress = [&](const StartUpCommand& command, const RobotSample&) {
    if (std::isnan(first_s)) first_s = command.remaining_s;
    EXPECT_GE(command.remaining_s, 0.0);
    last_s = command.remaining_s;
    return true;
  };
  const StartUpRun run = simulate_startup(robot, plan, options);
  EXPECT_NEAR(first_s, run.log.time_s[run.log.sample_count() - 1], 0.5 * first_s);
  EXPECT_EQ(last_s, 0.0);
  options.progress = [](const StartUpCommand& command, const RobotSample&) {
    return command.state != StartUpState::settling;
  };
  const StartUpRun stopped = simulate_startup(robot, plan, options);
  EXPECT_EQ(stopped.state, StartUpState::holding);
  EXPECT_EQ(stopped.reason, "stopped by the operator");
}

TEST(StartUp, IsAPureFunctionOfItsSamples) {
  const Robot robot = load_robot("irma4");
  StartUpPlan plan = irma4_plan();
  plan.setpoint_N.resize(2);
  StartUpRunOptions options;
  std::vector<RobotSample> samples;
  std::vector<CableVector> velocities;
  options.progress = [&](const StartUpCommand& command, const RobotSample& sample) {
    samples.push_back(sample);
    velocities.push_back(command.velocity_m_s);
    return true;
  };
  simulate_startup(robot, plan, options);
  StartUp again(robot, plan);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_EQ(again.step(samples[i]).velocity_m_s, velocities[i]) << i;
  }
  EXPECT_EQ(again.state(), StartUpState::done);
}

TEST(StartUp, RefusesPlansThatCannotBe) {
  const Robot robot = load_robot("irma4");
  const StartUpPlan good = irma4_plan();
  EXPECT_THROW(StartUp(robot, {}), InputError);
  StartUpPlan plan = good;
  plan.setpoint_N[3][1] = 401.0;
  EXPECT_THROW(StartUp(robot, plan), InputError);
  plan.setpoint_N[3][1] = 19.0;
  EXPECT_THROW(StartUp(robot, plan), InputError);
  plan.setpoint_N[3] = CableVector::Constant(3, 100.0);
  EXPECT_THROW(StartUp(robot, plan), InputError);
  plan.setpoint_N[3] = CableVector::Constant(4, kNaN);
  EXPECT_THROW(StartUp(robot, plan), InputError);
  plan.setpoint_N[3] = CableVector::Constant(4, 22.0);  // cannot carry the platform
  EXPECT_THROW(StartUp(robot, plan), InputError);
  plan = good;
  plan.via = {true};
  EXPECT_THROW(StartUp(robot, plan), InputError);
  plan = good;
  plan.transition_s = {1.0, 2.0};
  EXPECT_THROW(StartUp(robot, plan), InputError);
  StartUpOptions options;
  options.settle_timeout_s = 0.0;
  EXPECT_THROW(StartUp(robot, good, options), InputError);
}

TEST(StartUp, TransitionTimesComeFromTheRobotOrThePlan) {
  const Robot robot = load_robot("irma4");
  StartUpPlan plan = irma4_plan();
  const StartUp derived(robot, plan);
  plan.transition_s.assign(plan.setpoint_N.size(), 0.0);
  plan.transition_s[2] = 11.0;
  const StartUp given(robot, plan);
  EXPECT_EQ(given.transition_s(2), 11.0);
  EXPECT_EQ(given.transition_s(3), derived.transition_s(3));
  // Twice the mass at twice the tensions is the same robot for the clock; so is a second one.
  for (std::size_t k = 1; k < plan.setpoint_N.size(); ++k) {
    EXPECT_GT(derived.transition_s(k), 1.0);
    EXPECT_LT(derived.transition_s(k), 8.0);
  }
}

TEST(StartUp, PassesSetPointsWhereItIsNotToWaitForRest) {
  const Robot robot = load_robot("irma4");
  StartUpRunOptions options;
  const StartUpRun waited = simulate_startup(robot, irma4_plan(), options);
  options.startup.wait_for_rest = false;
  const StartUpRun passed = simulate_startup(robot, irma4_plan(), options);
  EXPECT_EQ(passed.state, StartUpState::done);
  EXPECT_TRUE(passed.rests.empty());
  EXPECT_FALSE(waited.rests.empty());
  EXPECT_LT(passed.log.time_s[passed.log.time_s.size() - 1],
            0.8 * waited.log.time_s[waited.log.time_s.size() - 1]);
  const StartUp planned(robot, irma4_plan(), options.startup);
  EXPECT_LT(planned.planned_duration_s(), StartUp(robot, irma4_plan()).planned_duration_s());
}

}  // namespace
}  // namespace cdprcal::test
