// The simulated robot as its user sees it: readings, commands, seeds.
#include "../support/startup_scenario.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal::test {
namespace {

CableVector hundred() { return CableVector::Constant(4, 100.0); }

TEST(Simulator, PerfectSensorsReadTheIdealKinematics) {
  for (const Robot& robot : {load_robot("irma4"), ring_robot(3), ring_robot(5)}) {
    SimulatorOptions options = perfect();
    options.strand.axial_stiffness_N = 1e12;
    Simulator simulator(robot, options);
    const StartUpPlan plan = robot.name == "irma4" ? irma4_plan() : ring_plan(robot);
    const RestResult rest = simulator.reset(plan.setpoint_N[1]);
    ASSERT_TRUE(rest.found) << rest.reason;
    const RobotSample sample = simulator.read();
    const PlatformState state = platform_state(robot, rest.pose);
    EXPECT_LT((sample.length_m - state.length_m()).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT((sample.swivel_rad - state.swivel_rad()).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_LT((sample.tension_N - plan.setpoint_N[1]).cwiseAbs().maxCoeff(), 1e-2);
    const Vector3 euler = euler_from_rotation(state.rotation, robot.euler_convention);
    EXPECT_LT((sample.roll_pitch_yaw_rad - euler).norm(), 1e-12);
  }
}

TEST(Simulator, NominalCablesAreAsGoodAsRigid) {
  const Robot robot = load_robot("irma4");
  Simulator simulator(robot, perfect());
  const RestResult rest = simulator.reset(irma4_plan().setpoint_N[1]);
  const CableVector stretch =
      platform_state(robot, rest.pose).length_m() - simulator.read().length_m;
  EXPECT_LT(stretch.cwiseAbs().maxCoeff(), 5e-5);  // a twentieth of a millimetre at 180 N
}

TEST(Simulator, TheSameSeedGivesTheSameBytes) {
  const Robot robot = load_robot("irma4");
  StartUpRunOptions options;
  options.simulator.seed = 5;
  options.simulator.effects = {parse_injected_effect("pulley_friction=0.02")};
  StartUpPlan plan = irma4_plan();
  plan.setpoint_N.resize(3);
  const std::string first = format_log(simulate_startup(robot, plan, options).log);
  EXPECT_EQ(first, format_log(simulate_startup(robot, plan, options).log));
  options.simulator.seed = 6;
  EXPECT_NE(first, format_log(simulate_startup(robot, plan, options).log));
}

TEST(Simulator, ResettingStartsOver) {
  Simulator simulator(load_robot("irma4"));
  simulator.reset(hundred());
  const RobotSample first = simulator.read();
  simulator.command_tension(CableVector::Constant(4, 110.0));
  simulator.advance(1.0);
  simulator.reset(hundred());
  EXPECT_EQ(simulator.time_s(), 0.0);
  EXPECT_EQ(simulator.read().length_m, first.length_m);
  EXPECT_EQ(simulator.read().roll_pitch_yaw_rad, first.roll_pitch_yaw_rad);
}

TEST(Simulator, NoiseQuantisationBiasAndRateAreAsAsked) {
  const Robot robot = load_robot("irma4");
  SimulatorOptions options = perfect();
  options.sensors.length_m = {.noise = 1e-3, .resolution = 0.0, .bias = 0.02, .rate_Hz = 200.0};
  options.sensors.tension_N = {.noise = 0.0, .resolution = 0.5, .bias = 0.0, .rate_Hz = 100.0};
  options.sensors.yaw_rad = {.noise = 2e-3};
  options.sensors.roll_pitch_rad = {.noise = 5e-4, .resolution = 0.0, .bias = 0.0, .rate_Hz = 50.0};
  Simulator simulator(robot, options);
  const RestResult rest = simulator.reset(hundred() * 0.997);
  const CableVector length = platform_state(robot, rest.pose).length_m();
  const Vector3 euler = euler_from_rotation(rest.pose.rotation_matrix(), robot.euler_convention);
  double sum = 0.0, squares = 0.0, roll = 0.0, yaw = 0.0;
  int changes = 0, attitude_changes = 0;
  RobotSample last = simulator.read();
  constexpr int kTicks = 20000;  // of a millisecond
  for (int i = 0; i < kTicks; ++i) {
    simulator.advance(0.001);
    const RobotSample now = simulator.read();
    if (now.length_m != last.length_m) {
      ++changes;
      const double error = now.length_m[0] - length[0];
      sum += error, squares += error * error;
    }
    if (now.roll_pitch_yaw_rad != last.roll_pitch_yaw_rad) {
      ++attitude_changes;
      roll += std::pow(now.roll_pitch_yaw_rad[0] - euler[0], 2);
      yaw += std::pow(now.roll_pitch_yaw_rad[2] - euler[2], 2);
    }
    ASSERT_EQ(now.tension_N[2], 0.5 * std::round(2.0 * now.tension_N[2]));
    last = now;
  }
  EXPECT_EQ(changes, 4000);
  EXPECT_EQ(attitude_changes, 1000);
  const double mean = sum / changes;
  EXPECT_NEAR(mean, 0.02, 5.0 * 1e-3 / std::sqrt(changes));
  EXPECT_NEAR(std::sqrt(squares / changes - mean * mean), 1e-3, 5e-5);
  EXPECT_NEAR(std::sqrt(roll / attitude_changes), 5e-4, 5e-5);
  EXPECT_NEAR(std::sqrt(yaw / attitude_changes), 2e-3, 2e-4);
}

TEST(Simulator, EffectsOfTheRobotFileAreInThePlant) {
  Robot robot = load_robot("irma4");
  SimulatorOptions options = perfect();
  options.effects = {parse_injected_effect("load_cell_bias=3,-2,4,1"),
                     parse_injected_effect("centre_of_mass=0.01,0,0.02"),
                     parse_injected_effect("swivel_sign=-1,1,1,1")};
  Simulator injected(robot, options);
  ASSERT_TRUE(injected.reset(hundred()).found);
  robot.effects = {{"load_cell_bias", "", {{"bias_N", {3, -2, 4, 1}}}},
                   {"centre_of_mass", "", {{"offset_m", {0.01, 0, 0.02}}}},
                   {"swivel_sign", "", {{"sign", {-1, 1, 1, 1}}}},
                   {"cable_creep", "another_run.csv", {{"amplitude_m", {0.01}}}}};
  Simulator known(robot, perfect());
  ASSERT_TRUE(known.reset(hundred()).found);
  for (Simulator* simulator : {&injected, &known}) {  // long enough for a cable to creep
    simulator->command_tension(hundred());
    ASSERT_TRUE(simulator->advance(20.0));
  }
  EXPECT_EQ(known.read().length_m, injected.read().length_m);
  EXPECT_EQ(known.read().tension_N, injected.read().tension_N);
  EXPECT_EQ(known.read().swivel_rad, injected.read().swivel_rad);
  EXPECT_EQ(known.truth().pose.position_m, injected.truth().pose.position_m);
}

TEST(Simulator, RelativeReadingsStartAnywhere) {
  const Robot robot = load_robot("irma4");
  SimulatorOptions options = perfect();
  options.sensors.random_offsets = true;
  Simulator simulator(robot, options);
  const RestResult rest = simulator.reset(hundred());
  const RobotSample sample = simulator.read();
  const PlatformState state = platform_state(robot, rest.pose);
  const Vector3 euler = euler_from_rotation(state.rotation, robot.euler_convention);
  const ReadingOffsets& offsets = simulator.offsets();
  EXPECT_GT(offsets.length_m.cwiseAbs().maxCoeff(), 0.1);
  EXPECT_LT((sample.length_m - state.length_m() - offsets.length_m).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_LT((sample.swivel_rad - state.swivel_rad() - offsets.swivel_rad).cwiseAbs().maxCoeff(),
            1e-9);
  EXPECT_NEAR(wrap_angle(sample.roll_pitch_yaw_rad[2] - euler[2] - offsets.yaw_rad), 0.0, 1e-9);
  EXPECT_NEAR(sample.roll_pitch_yaw_rad[0], euler[0], 1e-9);  // absolute
  EXPECT_NEAR(sample.roll_pitch_yaw_rad[1], euler[1], 1e-9);
}

TEST(Simulator, DelayShowsThePast) {
  const Robot robot = load_robot("irma4");
  SimulatorOptions options = perfect();
  Simulator now(robot, options);
  options.sensors.length_m.delay_s = 0.05;
  options.sensors.tension_N.delay_s = 0.0305;  // between two steps
  Simulator late(robot, options);
  for (Simulator* simulator : {&now, &late}) {
    simulator->reset(hundred());
    simulator->command_velocity(CableVector::Constant(4, 0.05));
  }
  std::vector<RobotSample> past;
  for (int i = 0; i < 100; ++i) {
    past.push_back(now.read());
    if (i >= 10) {
      EXPECT_LT((late.read().length_m - past[i - 5].length_m).cwiseAbs().maxCoeff(), 1e-12) << i;
      EXPECT_EQ(late.read().swivel_rad, past[i].swivel_rad);
    }
    now.advance(0.01);
    late.advance(0.01);
  }
}

TEST(Simulator, VelocityIsFollowedWithTheDrivesLag) {
  SimulatorOptions options = perfect();
  options.winch.time_constant_s = 0.05;
  Simulator simulator(load_robot("irma4"), options);
  simulator.reset(hundred());
  const CableVector before = simulator.read().length_m;
  simulator.command_velocity(CableVector::Constant(4, 0.02));
  simulator.advance(1.0);
  // ∫ v (1 − e^{−t/T}) = v (t − T)
  EXPECT_NEAR(simulator.read().length_m[2] - before[2], 0.02 * (1.0 - 0.05), 1e-8);
  simulator.command_velocity(CableVector::Constant(4, 50.0));
  const double then = simulator.read().length_m[2];
  simulator.advance(0.1);
  EXPECT_LT(simulator.read().length_m[2] - then, 0.1 * options.winch.max_velocity_m_s);
}

TEST(Simulator, WrongUseIsSaid) {
  const Robot robot = load_robot("irma4");
  SimulatorOptions options;
  options.step_s = 0.0;
  EXPECT_THROW(Simulator(robot, options), InputError);
  options = {};
  options.sensors.tension_N.noise = -1.0;
  EXPECT_THROW(Simulator(robot, options), InputError);
  options = {};
  options.effects = {{"load_cell_bias", {1.0, 2.0}}};
  EXPECT_THROW(Simulator(robot, options), InputError);
  Simulator simulator(robot);
  EXPECT_THROW(simulator.reset(CableVector::Constant(3, 100.0)), InputError);
  EXPECT_THROW(simulator.reset(CableVector::Constant(4, 0.0)), InputError);
  EXPECT_THROW(simulator.command_velocity(CableVector::Constant(4, kNaN)), InputError);
  EXPECT_FALSE(simulator.advance(0.1));  // nowhere yet
  EXPECT_FALSE(simulator.crashed().empty());
  // Not wrong, but impossible: a status.
  const RestResult rest = simulator.reset(CableVector::Constant(4, 1.0));
  EXPECT_FALSE(rest.found);
  EXPECT_FALSE(rest.reason.empty());
}

}  // namespace
}  // namespace cdprcal::test
