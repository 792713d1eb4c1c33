// The plant's mechanics, against what statics, algebra and conservation laws say.

#include "../support/startup_scenario.hpp"
#include "cdprcal/statics/natural_frequencies.hpp"
#include "cdprcal/statics/wrench.hpp"

namespace cdprcal::test {
namespace {

SimulatorOptions undamped() {
  SimulatorOptions options = perfect();
  options.damping = {std::numeric_limits<double>::infinity(),
                     std::numeric_limits<double>::infinity()};
  options.strand.damping_ratio = 0.0;
  options.winch.drum_damping_Nms = 0.0;
  return options;
}

CableVector equal(int n, double tension_N) { return CableVector::Constant(n, tension_N); }

/// Largest change of the total energy over a run, relative to the kinetic energy at the start.
double energy_drift(Simulator& simulator, double duration_s) {
  const PlantEnergy start = simulator.truth().energy;
  double worst = 0.0;
  for (int i = 0; i < static_cast<int>(duration_s * 10.0); ++i) {
    EXPECT_TRUE(simulator.advance(0.1)) << simulator.crashed();
    const double change = simulator.truth().energy.total_J() - start.total_J();
    worst = std::max(worst, std::abs(change) / start.kinetic_J);
  }
  return worst;
}

TEST(PlantDynamics, EnergyStaysForAMinuteOnLockedWinches) {
  // Swinging hard enough that cables go slack and snatch; ordinary cables and soft ones.
  for (const double stiffness_N : {1e7, 6e4}) {
    SimulatorOptions options = undamped();
    options.strand.axial_stiffness_N = stiffness_N;
    Simulator simulator(load_robot("irma4"), options);
    ASSERT_TRUE(simulator.reset(equal(4, 100.0)).found);
    simulator.push({0.05, 0.1, -0.02}, {0.1, 0.2, 0.3});
    EXPECT_LT(energy_drift(simulator, 60.0), 1e-6) << stiffness_N;
  }
}

TEST(PlantDynamics, EnergyStaysWithWinchesThatPullAtConstantTension) {
  // The motors' work is −Σ τ·(paid out): added up it closes the balance.
  SimulatorOptions options = undamped();
  options.winch.mode = WinchMode::torque;
  Simulator simulator(load_robot("irma4"), options);
  const CableVector tension = equal(4, 100.0);
  ASSERT_TRUE(simulator.reset(tension).found);
  simulator.command_tension(tension);
  simulator.push({0.05, 0.1, -0.02}, {0.1, 0.2, 0.3});
  const PlantEnergy start = simulator.truth().energy;
  const CableVector length = simulator.read().length_m;
  double worst = 0.0;
  for (int i = 0; i < 6000; ++i) {
    ASSERT_TRUE(simulator.advance(0.01)) << simulator.crashed();
    const double work = tension.dot(length - simulator.read().length_m);
    worst = std::max(worst, std::abs(simulator.truth().energy.total_J() - start.total_J() - work));
  }
  EXPECT_LT(worst / start.kinetic_J, 1e-6);
}

TEST(PlantDynamics, DampingOnlyTakesEnergyAway) {
  Simulator simulator(load_robot("irma4"), perfect());
  ASSERT_TRUE(simulator.reset(equal(4, 100.0)).found);
  simulator.push({0.05, 0.1, -0.02}, {0.1, 0.2, 0.3});
  double before = simulator.truth().energy.total_J();
  for (int i = 0; i < 3000; ++i) {
    simulator.advance(0.001);
    const double now = simulator.truth().energy.total_J();
    ASSERT_LE(now, before + 1e-9);
    before = now;
  }
  EXPECT_LT(simulator.truth().energy.kinetic_J, 1e-2 * 0.0954);  // two to three seconds
}

/// Frequency [Hz] of the motion along a mode: zero crossings of its coordinate, interpolated.
double measured_frequency_hz(Simulator& simulator, const Pose& rest, const Vector6& dual,
                             double expected_hz) {
  const double step_s = 0.002;
  const double duration_s = 12.0 / expected_hz;
  double previous = dual.dot(minus(simulator.truth().pose, rest));
  std::vector<double> crossings_s;
  for (double t = step_s; t < duration_s; t += step_s) {
    EXPECT_TRUE(simulator.advance(step_s));
    const double now = dual.dot(minus(simulator.truth().pose, rest));
    if (previous < 0.0 && now >= 0.0) crossings_s.push_back(t - step_s * now / (now - previous));
    previous = now;
  }
  if (crossings_s.size() < 5) return kNaN;
  return static_cast<double>(crossings_s.size() - 1) / (crossings_s.back() - crossings_s.front());
}

/// Starts a motion along a twist of P, so small that it stays linear.
void start_along(Simulator& simulator, const Robot& robot, const Vector6& twist, double rad_s) {
  const PlatformState state = platform_state(robot, simulator.truth().pose);
  const Vector6 rate = 2e-4 * rad_s * twist / twist.norm();
  const Vector3 omega = rate.tail<3>();
  simulator.push(rate.head<3>() + omega.cross(state.centre_of_mass_arm_m),
                 state.rotation.transpose() * omega);
}

TEST(PlantDynamics, SmallOscillationsOnLockedWinchesHaveTheModelsFrequencies) {
  for (const Robot& robot : {load_robot("irma4"), ring_robot(3), ring_robot(5)}) {
    const StartUpPlan plan = robot.name == "irma4" ? irma4_plan() : ring_plan(robot);
    for (const std::size_t k : {0u, 2u, 7u}) {
      const CableVector& tension = plan.setpoint_N[k];
      Simulator simulator(robot, undamped());
      const RestResult rest = simulator.reset(tension);
      ASSERT_TRUE(rest.found) << rest.reason;
      const PlatformState state = platform_state(robot, rest.pose);
      const Modes modes = free_motion_modes(robot, state, tension);
      ASSERT_EQ(modes.shape.cols(), 6 - robot.cable_count());
      for (Eigen::Index mode = 0; mode < modes.shape.cols(); ++mode) {
        SCOPED_TRACE(robot.name + ", mode " + std::to_string(mode));
        const double expected_hz = modes.natural_frequency_hz[mode];
        ASSERT_TRUE(simulator.reset(tension).found);
        start_along(simulator, robot, modes.shape.col(mode), 2.0 * kPi * expected_hz);
        const Vector6 dual = mass_matrix(robot, state) * modes.shape.col(mode);
        EXPECT_NEAR(measured_frequency_hz(simulator, rest.pose, dual, expected_hz), expected_hz,
                    0.01 * expected_hz);
      }
    }
  }
}

TEST(PlantDynamics, SmallOscillationsAtConstantTensionsHaveTheModelsFrequencies) {
  const Robot robot = load_robot("irma4");
  const StartUpPlan plan = irma4_plan();
  SimulatorOptions options = undamped();
  options.winch.mode = WinchMode::torque;
  options.winch.drum_inertia_kg_m2 = 1e-6;
  Simulator simulator(robot, options);
  for (const std::size_t k : {0u, 3u}) {
    const CableVector& tension = plan.setpoint_N[k];
    const RestResult rest = simulator.reset(tension);
    ASSERT_TRUE(rest.found) << rest.reason;
    const PlatformState state = platform_state(robot, rest.pose);
    const Modes modes = constant_tension_modes(robot, state, tension);
    ASSERT_EQ(modes.shape.cols(), 6);
    for (Eigen::Index mode = 0; mode < 6; ++mode) {
      SCOPED_TRACE("mode " + std::to_string(mode));
      const double expected_hz = modes.natural_frequency_hz[mode];
      ASSERT_TRUE(simulator.reset(tension).found);
      simulator.command_tension(tension);
      start_along(simulator, robot, modes.shape.col(mode), 2.0 * kPi * expected_hz);
      const Vector6 dual = mass_matrix(robot, state) * modes.shape.col(mode);
      EXPECT_NEAR(measured_frequency_hz(simulator, rest.pose, dual, expected_hz), expected_hz,
                  0.01 * expected_hz);
    }
  }
}

TEST(PlantDynamics, SettlesInTheEquilibriumOfTheDirectProblem) {
  for (const WinchMode mode : {WinchMode::tension, WinchMode::torque}) {
    for (const Robot& robot : {load_robot("irma4"), ring_robot(3), ring_robot(5)}) {
      SCOPED_TRACE(robot.name);
      const StartUpPlan plan = robot.name == "irma4" ? irma4_plan() : ring_plan(robot);
      SimulatorOptions options = perfect();
      options.winch.mode = mode;
      Simulator simulator(robot, options);
      ASSERT_TRUE(simulator.reset(plan.setpoint_N[0]).found);
      simulator.command_tension(plan.setpoint_N[2]);  // a jump, not a smooth transition
      ASSERT_TRUE(simulator.advance(90.0)) << simulator.crashed();
      const PlantTruth truth = simulator.truth();
      const EquilibriumResult rest = direct_from_tensions(robot, plan.setpoint_N[2], truth.pose);
      ASSERT_EQ(rest.status, EquilibriumStatus::found);
      const Vector6 error = minus(truth.pose, rest.pose);
      EXPECT_LT(error.head<3>().norm(), 1e-6);
      EXPECT_LT(error.tail<3>().norm(), 1e-6);
      EXPECT_LT((truth.tension_N - plan.setpoint_N[2]).cwiseAbs().maxCoeff(), 1e-5);
    }
  }
}

TEST(PlantDynamics, LockedWinchesHangWhereTheLengthsSay) {
  const Robot robot = load_robot("irma4");
  Simulator simulator(robot, perfect());
  // Not an equilibrium: one that is knocked askew. The lengths stay, the platform turns back.
  const InverseResult hangs = inverse(robot, {0.1, -0.2, 0.9});
  ASSERT_EQ(hangs.status, EquilibriumStatus::found);
  Vector6 askew;
  askew << 0.004, -0.006, 0.002, 0.02, -0.01, 0.03;
  const Pose pose = plus(hangs.pose, askew);
  const RestResult rest = simulator.reset(pose);
  ASSERT_TRUE(rest.found) << rest.reason;
  const EquilibriumResult ideal =
      direct_from_lengths(robot, platform_state(robot, pose).length_m(), pose);
  EXPECT_LT(minus(rest.pose, ideal.pose).norm(), 1e-8);
  EXPECT_GT(minus(rest.pose, pose).norm(), 1e-3);
  ASSERT_TRUE(simulator.advance(5.0));
  EXPECT_LT(minus(simulator.truth().pose, rest.pose).norm(), 1e-6);
}

TEST(PlantDynamics, ASlackCableDoesNotPush) {
  Simulator simulator(load_robot("irma4"), perfect());
  ASSERT_TRUE(simulator.reset(equal(4, 100.0)).found);
  CableVector velocity = equal(4, 0.0);
  velocity[1] = 0.2;
  simulator.command_velocity(velocity);
  for (int i = 0; i < 200; ++i) {
    ASSERT_TRUE(simulator.advance(0.01));
    ASSERT_GE(simulator.truth().tension_N.minCoeff(), 0.0);
  }
  EXPECT_EQ(simulator.truth().tension_N[1], 0.0);
  // Three cables carry the weight then.
  simulator.hold();
  simulator.advance(20.0);
  const PlantTruth truth = simulator.truth();
  const Robot robot = load_robot("irma4");
  EXPECT_LT(wrench_residual(robot, platform_state(robot, truth.pose), truth.tension_N).norm(),
            1e-2);
}

TEST(PlantDynamics, StepSizeDoesNotMatterForTheMotion) {
  const Robot robot = load_robot("irma4");
  std::vector<Pose> poses;
  for (const double step_s : {2e-3, 1e-3, 5e-4}) {
    SimulatorOptions options = perfect();
    options.step_s = step_s;
    Simulator simulator(robot, options);
    simulator.reset(irma4_plan().setpoint_N[0]);
    simulator.command_tension(irma4_plan().setpoint_N[1]);
    simulator.advance(2.0);
    poses.push_back(simulator.truth().pose);
  }
  EXPECT_LT(minus(poses[1], poses[2]).norm(), 1e-4);
  EXPECT_LT(minus(poses[0], poses[2]).norm(), 5e-4);
}

/// Catenary between two points, inextensible, from its horizontal tension [N].
struct Catenary {
  double length_m, at_pulley_N, slope_at_pulley;
};
Catenary catenary(double weight_N_m, double across_m, double down_m, double horizontal_N) {
  // y = c cosh((x − a)/c): solved for the place of the lowest point.
  const double c = horizontal_N / weight_N_m;
  const double half = across_m / (2.0 * c);
  // down = y(0) − y(across) = −2 c sinh(half) sinh((across/2 − a)/c)
  const double b = std::asinh(-down_m / (2.0 * c * std::sinh(half)));
  const double begin = b - half, end = b + half;  // (x − a)/c at both ends
  return {c * (std::sinh(end) - std::sinh(begin)), horizontal_N * std::cosh(begin),
          std::sinh(begin)};
}

TEST(PlantStrand, SagIsThatOfTheCatenary) {
  Pulley eyelet;
  eyelet.axes_world << 0, 0, 1, 0, 1, 0, -1, 0, 0;  // x down, swivel axis along world x
  const StrandLaw law{1e14, 0.08 * 9.81};           // does not stretch, like the exact one
  for (const double horizontal_N : {15.0, 40.0, 120.0}) {
    const double across = 1.2, down = 0.9;
    const Catenary exact = catenary(law.weight_N_m, across, down, horizontal_N);
    const Vector3 q(0.0, across, -down);
    // Fixed point of drop and tension, as the plant has it over its steps.
    StrandState state = strand_state(eyelet, q, 0.0);
    double tension = horizontal_N;
    for (int i = 0; i < 50; ++i) {
      tension = sagging_tension(law, state.length_m, exact.length_m, state).tension_N;
      state = strand_state(eyelet, q, strand_drop_m(law, state.chord_m, tension));
    }
    // The parabola's error: second order in weight ÷ tension.
    const double order = std::pow(law.weight_N_m * 1.5 / horizontal_N, 2);
    const double at_pulley = tension_at_pulley_N(law, state, tension);
    EXPECT_NEAR(at_pulley, exact.at_pulley_N, 1.5 * order * at_pulley) << horizontal_N;
    EXPECT_NEAR(chord_tension_N(law, state, at_pulley), tension, 1e-9 * tension);
    EXPECT_NEAR(natural_length_m(law, state, tension), exact.length_m, 1e-9);
    // The swivel turns after the tangent: its angle from straight down.
    EXPECT_NEAR(std::tan(state.cable.swivel_rad), -1.0 / exact.slope_at_pulley, 2.0 * order)
        << horizontal_N;
    EXPECT_GT(-exact.slope_at_pulley, down / across);  // steeper than the chord
  }
}

}  // namespace
}  // namespace cdprcal::test
