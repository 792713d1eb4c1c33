// Faults, one by one: each ends in the safe state, with its reason, and the log is kept.
#include <gmock/gmock.h>

#include "../support/startup_scenario.hpp"

namespace cdprcal::test {
namespace {

using ::testing::HasSubstr;

class StartUpFaults : public ::testing::Test {
 protected:
  const Robot robot = load_robot("irma4");
  StartUpPlan plan = irma4_plan();
  StartUpRunOptions options;
  static constexpr double kFault_s = 9.0;  // while moving

  void SetUp() override { plan.setpoint_N.resize(3); }

  /// Runs with the fault from kFault_s on; expects the safe state for this reason.
  StartUpRun expect_hold(const std::function<void(RobotSample&)>& fault, const std::string& reason,
                         double within_s = 0.5) {
    if (fault) {
      options.tamper = [fault](RobotSample& sample) {
        if (sample.time_s >= kFault_s - 1e-9) fault(sample);
      };
    }
    CableVector last_velocity;
    bool locked = false;
    options.progress = [&](const StartUpCommand& command, const RobotSample&) {
      last_velocity = command.velocity_m_s;
      locked = command.locked;
      return true;
    };
    const StartUpRun run = simulate_startup(robot, plan, options);
    EXPECT_EQ(run.state, StartUpState::holding);
    EXPECT_THAT(run.reason, HasSubstr(reason));
    EXPECT_TRUE(locked);
    EXPECT_TRUE(last_velocity.isZero(0.0));
    EXPECT_GT(run.log.sample_count(), 0);
    EXPECT_NO_THROW(validate(run.log));
    for (const StartUpChange& change : run.changes) {
      if (change.state == StartUpState::holding) {
        EXPECT_LE(change.time_s, kFault_s + within_s);
      }
    }
    // A lying sensor must not make the winches pull; a torn cable lets the others catch the weight.
    if (fault) {
      EXPECT_LT(run.max_tension_N, robot.tension_max_N);
    }
    return run;
  }
};

TEST_F(StartUpFaults, LoadCellDead) {
  expect_hold([](RobotSample& s) { s.tension_N[2] = kNaN; }, "cable 3: the load cell does not");
}

TEST_F(StartUpFaults, EncoderDead) {
  expect_hold([](RobotSample& s) { s.length_m[0] = kNaN; }, "cable 1: the winch encoder does not");
}

TEST_F(StartUpFaults, SwivelDead) {
  expect_hold([](RobotSample& s) { s.swivel_rad[3] = kNaN; },
              "cable 4: the swivel encoder does not");
}

TEST_F(StartUpFaults, AhrsDead) {
  expect_hold([](RobotSample& s) { s.roll_pitch_yaw_rad.setConstant(kNaN); },
              "the AHRS does not answer", 0.7);
}

TEST_F(StartUpFaults, AGroupGoesMissing) {
  expect_hold([](RobotSample& s) { s.tension_N.resize(0); }, "the load cell does not");
}

TEST_F(StartUpFaults, DrivesStale) {
  expect_hold([](RobotSample& s) { s.drives_time_s = kFault_s; }, "stale");
}

TEST_F(StartUpFaults, AhrsStale) {
  expect_hold([](RobotSample& s) { s.attitude_time_s = kFault_s; }, "AHRS readings are stale", 0.7);
}

TEST_F(StartUpFaults, LoadCellStuck) {
  expect_hold([](RobotSample& s) { s.tension_N[1] = 101.25; }, "cable 2: the load cell is stuck",
              1.2);
}

TEST_F(StartUpFaults, EncoderStuck) {
  // Noticed because it no longer flickers, or because it should have moved: whichever is first.
  expect_hold([](RobotSample& s) { s.length_m[1] = 0.25; }, "cable 2: the winch", 1.2);
}

TEST_F(StartUpFaults, EncoderWithoutNoiseStuck) {
  // It never flickered, so standing still says nothing by itself.
  options.simulator.sensors.length_m.noise = 0.0;
  plan.transition_s = {3.0, 8.0, 8.0};
  expect_hold([](RobotSample& s) { s.length_m[1] = 0.25; }, "cable 2: the winch", 6.0);
}

TEST_F(StartUpFaults, AhrsStuck) {
  expect_hold([](RobotSample& s) { s.roll_pitch_yaw_rad << 0.01, 0.02, 0.03; }, "AHRS is stuck",
              1.2);
}

TEST_F(StartUpFaults, LoadCellLies) {
  // Plausible, noisy, and wrong: it no longer follows.
  RandomNormal noise(3);
  expect_hold([&](RobotSample& s) { s.tension_N[0] = 60.0 + noise(); },
              "cable 1: the tension does not follow", 2.0);
}

TEST_F(StartUpFaults, SlackCable) {
  RandomNormal noise(3);
  expect_hold([&](RobotSample& s) { s.tension_N[0] = 1.0 + 0.1 * noise(); }, "cable 1: slack");
}

TEST_F(StartUpFaults, CableTornInThePlant) {
  // Two metres run off: nothing the loop could haul in.
  options.simulator.effects = {parse_injected_effect("cable_slip=9,2,2")};
  const StartUpRun run = expect_hold(nullptr, "cable 2: slack", 2.0);
  EXPECT_LT(run.truth.back().tension_N[1], 1.0);
}

TEST_F(StartUpFaults, OverTension) {
  RandomNormal noise(3);
  expect_hold([&](RobotSample& s) { s.tension_N[2] = 450.0 + noise(); }, "cable 3: over-tension");
}

TEST_F(StartUpFaults, DriveError) {
  expect_hold([](RobotSample& s) { s.drive_error = "node 3: following error"; },
              "drive error: node 3: following error");
}

TEST_F(StartUpFaults, OperatorStops) {
  expect_hold([](RobotSample& s) { s.stop_requested = true; }, "stopped by the operator");
}

TEST_F(StartUpFaults, TheComputerCannotGoOn) {
  expect_hold([](RobotSample& s) { s.host_error = "the log cannot be written: disk full"; },
              "the log cannot be written: disk full");
}

TEST_F(StartUpFaults, ClockRunsBackwards) {
  expect_hold([](RobotSample& s) { s.time_s -= 5.0; }, "clock", 6.0);
}

TEST_F(StartUpFaults, ClockIsNotANumber) {
  options.tamper = [](RobotSample& s) {
    if (s.time_s >= kFault_s) s.time_s = kNaN;
  };
  const StartUpRun run = simulate_startup(robot, plan, options);
  EXPECT_EQ(run.state, StartUpState::holding);
  EXPECT_THAT(run.reason, HasSubstr("clock"));
}

TEST_F(StartUpFaults, NeverAtRest) {
  options.simulator.damping = {std::numeric_limits<double>::infinity(),
                               std::numeric_limits<double>::infinity()};
  options.startup.settle_timeout_s = 4.0;
  RandomNormal noise(1);
  // A wind: the angles sway by a degree.
  options.tamper = [](RobotSample& s) {
    s.roll_pitch_yaw_rad[0] += 0.02 * std::sin(5.0 * s.time_s);
  };
  const StartUpRun run = simulate_startup(robot, plan, options);
  EXPECT_EQ(run.state, StartUpState::holding);
  EXPECT_THAT(run.reason, HasSubstr("does not come to rest"));
}

TEST_F(StartUpFaults, ShortGapsAreRiddenOut) {
  // A lost frame now and then is no fault.
  int count = 0;
  options.tamper = [&count](RobotSample& s) {
    if (++count % 50 < 5) s.tension_N.setConstant(kNaN);
    if (count % 70 < 8) s.roll_pitch_yaw_rad.setConstant(kNaN);
  };
  const StartUpRun run = simulate_startup(robot, plan, options);
  EXPECT_EQ(run.state, StartUpState::done) << run.reason;
}

TEST_F(StartUpFaults, AnAbsentSensorIsNoFault) {
  options.tamper = [](RobotSample& s) {
    s.swivel_rad.resize(0);
    s.roll_pitch_yaw_rad.setConstant(kNaN);
  };
  const StartUpRun run = simulate_startup(robot, plan, options);
  EXPECT_EQ(run.state, StartUpState::done) << run.reason;
  EXPECT_TRUE(run.log.swivel_rad.array().isNaN().all());
}

TEST_F(StartUpFaults, TheStopIsSmoothInVelocityMode) {
  options.simulator.winch.mode = WinchMode::velocity;
  options.simulator.strand.axial_stiffness_N = 1e5;
  CableVector previous = CableVector::Zero(4);
  double largest_step = 0.0;
  options.progress = [&](const StartUpCommand& command, const RobotSample&) {
    largest_step = std::max(largest_step, (command.velocity_m_s - previous).cwiseAbs().maxCoeff());
    previous = command.velocity_m_s;
    return true;
  };
  options.tamper = [](RobotSample& s) { s.stop_requested = s.time_s >= kFault_s; };
  const StartUpRun run = simulate_startup(robot, plan, options);
  EXPECT_EQ(run.state, StartUpState::holding);
  EXPECT_GT(run.max_velocity_m_s, 0.02);
  // The limit in 0.2 s: a twentieth of it in one step of 10 ms.
  EXPECT_LE(largest_step, StartUp(robot, plan).velocity_limit_m_s() / 20.0 * (1.0 + 1e-6));
}

}  // namespace
}  // namespace cdprcal::test
