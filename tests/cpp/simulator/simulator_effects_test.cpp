// Each injected effect does to the readings what its equation says (measured = …), seen from
// outside: readings against the ideal model at the true pose, statics at the true tensions.
#include <functional>
#include <memory>

#include "../support/startup_scenario.hpp"
#include "cdprcal/effects/applied.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/statics/wrench.hpp"

namespace cdprcal {
std::shared_ptr<const Effect> swivel_drift();      // of docs/extend/effect.md
std::vector<InjectableEffect> rows_of_the_page();  // the same effect in the plant
}  // namespace cdprcal

namespace cdprcal::test {
namespace {

/// The simulated irma4, resting: what it reads, where it truly is, what the ideal model says there.
struct Rest {
  RobotSample sample;
  PlantTruth truth;
  PlatformState ideal;
  Vector3 euler;
};

/// Pulleys that are off by a linear function of their place from the middle of all.
void move_from_the_middle(Robot& r, const Matrix3& strain) {
  Vector3 middle = Vector3::Zero();
  for (const Cable& c : r.cables) middle += c.pulley.position_m / 4.0;
  for (Cable& c : r.cables) c.pulley.position_m += strain * (c.pulley.position_m - middle);
}

class InjectedEffects : public ::testing::Test {
 protected:
  const Robot robot = load_robot("irma4");
  // Near enough to the middle that effects and errors of the tensions do not end in a pulley.
  const StartUpPlan plan = box_plan(robot, {-0.2, -0.2, 0.7}, {0.2, 0.2, 1.0});
  CableVector commanded_N;
  std::unique_ptr<Simulator> simulator;

  void start(const std::vector<std::string>& effects, std::size_t setpoint = 0,
             double axial_stiffness_N = 1e9) {
    SimulatorOptions options = perfect();
    options.strand.axial_stiffness_N = axial_stiffness_N;
    for (const std::string& text : effects) {
      options.effects.push_back(parse_injected_effect(text));
    }
    simulator = std::make_unique<Simulator>(robot, options);
    commanded_N = plan.setpoint_N[setpoint];
    const RestResult rest = simulator->reset(commanded_N);
    ASSERT_TRUE(rest.found) << rest.reason;
  }
  [[nodiscard]] Rest look() const {
    Rest rest{simulator->read(), simulator->truth(), {}, {}};
    rest.ideal = platform_state(robot, rest.truth.pose);
    rest.euler = euler_from_rotation(rest.ideal.rotation, robot.euler_convention);
    return rest;
  }
  /// A smooth transition of 5 s, then rest, `duration_s` in all.
  Rest go(std::size_t setpoint, double duration_s = 60.0) {
    const CableVector from_N = commanded_N;
    commanded_N = plan.setpoint_N[setpoint];
    for (int i = 1; i <= 100; ++i) {
      simulator->command_tension(from_N + fifth_degree(0.01 * i) * (commanded_N - from_N));
      EXPECT_TRUE(simulator->advance(0.05)) << simulator->crashed();
    }
    EXPECT_TRUE(simulator->advance(duration_s - 5.0)) << simulator->crashed();
    return look();
  }
  /// Change of the length readings between two rests, and of the ideal lengths.
  static CableVector change(const Rest& a, const Rest& b) {
    return b.sample.length_m - a.sample.length_m;
  }
  static CableVector ideal_change(const Rest& a, const Rest& b) {
    return b.ideal.length_m() - a.ideal.length_m();
  }
  [[nodiscard]] Vector6 imbalance(const Rest& rest) const {
    return wrench_residual(robot, rest.ideal, rest.truth.tension_N);
  }
};

#define EXPECT_CLOSE(a, b, tolerance) EXPECT_LT(((a) - (b)).cwiseAbs().maxCoeff(), tolerance)

TEST_F(InjectedEffects, NoneIsTheIdealRobot) {
  start({});
  const Rest a = look(), b = go(1);
  EXPECT_CLOSE(change(a, b), ideal_change(a, b), 1e-6);
  EXPECT_CLOSE(b.sample.swivel_rad, b.ideal.swivel_rad(), 1e-9);
  EXPECT_CLOSE(b.sample.tension_N, b.truth.tension_N, 1e-4);
  EXPECT_CLOSE(b.sample.roll_pitch_yaw_rad, b.euler, 1e-9);
  EXPECT_LT(imbalance(b).norm(), 1e-3);
}

TEST_F(InjectedEffects, TransmissionRatio) {
  start({"transmission_ratio=0.02,-0.01,0.005,0.03"});
  const Rest a = look(), b = go(6);
  const Eigen::Array4d factor(1.02, 0.99, 1.005, 1.03);
  EXPECT_CLOSE(change(a, b).array(), factor * ideal_change(a, b).array(), 1e-6);
  EXPECT_GT(ideal_change(a, b).cwiseAbs().minCoeff(), 0.02);
}

TEST_F(InjectedEffects, CableElasticity) {
  start({"cable_elasticity=15000"});
  const Rest a = look(), b = go(5);
  const auto unstretched = [](const Rest& r) -> CableVector {
    return r.ideal.length_m().array() / (1.0 + r.truth.tension_N.array() / 15000.0);
  };
  EXPECT_CLOSE(change(a, b), unstretched(b) - unstretched(a), 1e-7);
  EXPECT_GT((change(a, b) - ideal_change(a, b)).cwiseAbs().maxCoeff(), 1e-3);
}

TEST_F(InjectedEffects, CableCreep) {
  start({"cable_creep=0.004"});
  const Rest a = look();
  const Rest b = go(0, 270.0);
  EXPECT_CLOSE(change(a, b), ideal_change(a, b) - CableVector::Constant(4, 0.004),
               1e-6);  // one decade
}

TEST_F(InjectedEffects, CableSag) {
  constexpr double kDensity = 0.06;
  // Held at 1e9 N, a sagging strand rings until the step is not solved any more; that is a hundred
  // times stiffer than steel of this size.
  start({"cable_sag=0.06"}, 0, 1e7);
  go(6);
  simulator->hold();
  ASSERT_TRUE(simulator->advance(10.0)) << simulator->crashed();
  const Rest r = look();
  const double w = kDensity * robot.gravity_m_s2;
  Vector6 balance = imbalance(r);
  for (int i = 0; i < 4; ++i) {
    const CableState& cable = r.ideal.cable[i];
    const double half = 0.5 * w * cable.free_length_m;
    // The load cell feels the pulley's end; the chord pulls the platform, half the weight hangs
    // there.
    const Vector3 pull = half * cable.direction.z() * cable.direction + Vector3(0.0, 0.0, half);
    balance.head<3>() += pull;
    balance.tail<3>() += r.ideal.anchor_arm_m[i].cross(pull);
    // The swivel sees the cable leave lower than its chord.
    const double drop =
        w * cable.free_length_m * cable.free_length_m / (2.0 * r.truth.tension_N[i]);
    const Vector3 q = r.truth.pose.position_m + r.ideal.anchor_arm_m[i] -
                      robot.cables[i].pulley.position_m - Vector3(0.0, 0.0, drop);
    const double tilt = cable_state(robot.cables[i].pulley, q).swivel_rad - cable.swivel_rad;
    EXPECT_GT(std::abs(tilt), 1e-3);
    EXPECT_NEAR(r.sample.swivel_rad[i] - cable.swivel_rad, tilt, 0.1 * std::abs(tilt));
  }
  EXPECT_GT(imbalance(r).norm(), 1.0);
  EXPECT_LT(balance.norm(), 0.05 * imbalance(r).norm());
}

TEST_F(InjectedEffects, PulleyFriction) {
  start({"pulley_friction=0.03"});
  const Rest b = go(1);
  EXPECT_LT(imbalance(b).norm(), 1e-3);  // the strands' own tensions carry the platform
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(b.sample.tension_N[i],
                b.truth.tension_N[i] * std::exp(-0.03 * b.truth.direction[i]), 1e-3);
  }
  EXPECT_GT((b.sample.tension_N - b.truth.tension_N).cwiseAbs().maxCoeff(), 2.0);
  // The sign, commanded: paying out reads less than the strand's tension, hauling in more.
  for (const double sign : {1.0, -1.0}) {
    simulator->command_velocity(CableVector::Constant(4, sign * 0.01));
    simulator->advance(1.0);
    const Rest moved = look();
    EXPECT_CLOSE(moved.truth.direction, CableVector::Constant(4, sign), 1e-12);
    EXPECT_CLOSE(moved.sample.tension_N, moved.truth.tension_N * std::exp(-sign * 0.03), 0.05);
  }
}

TEST_F(InjectedEffects, FrictionTurnsOverInAMillimetreAndADwellKeepsIt) {
  start({"pulley_friction=0.03"});
  const auto run = [&](double distance_m) {
    simulator->command_velocity(CableVector::Constant(4, std::copysign(0.01, distance_m)));
    simulator->advance(std::abs(distance_m) / 0.01);
    simulator->hold();
    simulator->advance(3.0);
    return simulator->truth().direction[0];
  };
  EXPECT_NEAR(run(0.02), 1.0, 1e-12);
  EXPECT_GT(run(-0.0002), 0.0);  // half way after less than half a millimetre …
  EXPECT_LT(run(-0.0004), 0.0);
  EXPECT_GT(run(-0.0003), -1.0);
  EXPECT_NEAR(run(-0.001), -1.0, 1e-12);  // … over after one and a half
  run(0.0005);
  // Jitter of 0.1 mm, as a tension loop makes, moves s to and fro; it does not wander off.
  run(1e-4);
  const double before = run(-1e-4);
  for (int i = 0; i < 20; ++i) run(1e-4), run(-1e-4);
  EXPECT_NEAR(simulator->truth().direction[0], before, 1e-9);
  EXPECT_LT(std::abs(before), 0.5);
}

TEST_F(InjectedEffects, BendingHysteresis) {
  start({"bending_hysteresis=2,0.01"});
  for (const double sign : {1.0, -1.0}) {
    simulator->command_velocity(CableVector::Constant(4, sign * 0.01));
    simulator->advance(1.0);
    const Rest r = look();
    EXPECT_CLOSE(r.sample.tension_N.array(),
                 r.truth.tension_N.array() - sign * (2.0 + 0.01 * r.truth.tension_N.array()), 1e-6);
  }
}

TEST_F(InjectedEffects, SwivelHysteresis) {
  start({"swivel_hysteresis=0.01"});
  const Rest a = look();
  const Rest b = go(1);
  for (int i = 0; i < 4; ++i) {
    const double turned = b.ideal.cable[i].swivel_rad - a.ideal.cable[i].swivel_rad;
    if (std::abs(turned) < 0.05) continue;
    EXPECT_NEAR(b.sample.swivel_rad[i], b.ideal.cable[i].swivel_rad - std::copysign(0.01, turned),
                2e-3);
  }
  for (int i = 0; i < 4; ++i) {
    EXPECT_LE(std::abs(b.sample.swivel_rad[i] - b.ideal.cable[i].swivel_rad), 0.01 + 1e-9);
  }
}

TEST_F(InjectedEffects, WhatLagsIsWhereItsLastMotionBeforePowerOnLeftIt) {
  SimulatorOptions options = perfect();
  options.sensors.random_offsets = true;
  const auto first_sample = [&](const std::vector<std::string>& effects) {
    options.effects.clear();
    for (const std::string& text : effects) options.effects.push_back(parse_injected_effect(text));
    Simulator begun(robot, options);
    EXPECT_TRUE(begun.reset(plan.setpoint_N[0]).found);
    return begun.read();
  };
  int at_an_end = 0, all = 0;
  for (options.seed = 1; options.seed <= 6; ++options.seed) {
    const RobotSample free = first_sample({});
    const RobotSample lagging = first_sample({"swivel_hysteresis=0.01", "pulley_friction=0.02"});
    for (int i = 0; i < 4; ++i) {
      const double swivel = (lagging.swivel_rad[i] - free.swivel_rad[i]) / 0.01;
      const double cable = std::log(lagging.tension_N[i] / free.tension_N[i]) / 0.02;
      for (const double s : {swivel, cable}) {
        EXPECT_LE(std::abs(s), 1.0 + 1e-6);
        at_an_end += std::abs(s) > 0.99 ? 1 : 0;
        ++all;
      }
    }
  }
  EXPECT_GT(at_an_end, all / 3);
  EXPECT_LT(at_an_end, all);
}

TEST_F(InjectedEffects, SwivelScale) {
  start({"swivel_scale=0.03,-0.02,0,0.05"});
  const Rest b = go(1);
  const Eigen::Array4d factor(1.03, 0.98, 1.0, 1.05);
  EXPECT_CLOSE(b.sample.swivel_rad.array(), factor * b.ideal.swivel_rad().array(), 1e-9);
}

TEST_F(InjectedEffects, GeometryAndInertiaAreTheTrueRobots) {
  struct Case {
    std::string effect;
    std::function<void(Robot&)> apply;
  };
  const std::vector<Case> cases{
      {"pulley_radius=0.001,-0.002,0.0005,0.003",
       [](Robot& r) {
         const double delta[] = {0.001, -0.002, 0.0005, 0.003};
         for (int i = 0; i < 4; ++i) r.cables[i].pulley.radius_m += delta[i];
       }},
      {"pulley_diameter=-0.015",
       [](Robot& r) {
         for (Cable& cable : r.cables) cable.pulley.radius_m -= 0.015;
       }},
      {"frame_anchors=0.01,0,0,0,0.02,0,0,0,-0.01,0.005,0.005,0.005",
       [](Robot& r) {
         r.cables[0].pulley.position_m.x() += 0.01;
         r.cables[1].pulley.position_m.y() += 0.02;
         r.cables[2].pulley.position_m.z() -= 0.01;
         r.cables[3].pulley.position_m.array() += 0.005;
       }},
      {"frame_scale=0.004,-0.003,0.01",
       [](Robot& r) { move_from_the_middle(r, Vector3(0.004, -0.003, 0.01).asDiagonal()); }},
      {"frame_shear=0.004,0.002,-0.006",
       [](Robot& r) {
         Matrix3 half;
         half << 0, 0.002, 0.001, 0.002, 0, -0.003, 0.001, -0.003, 0;
         move_from_the_middle(r, half);
       }},
      {"frame_warp=0.01",
       [](Robot& r) {  // the corners of irma4 are about its origin
         for (Cable& c : r.cables) {
           Vector3& at = c.pulley.position_m;
           at.z() += 0.01 * (at.x() / 1.066) * (at.y() / 1.155);
         }
       }},
      {"platform_anchors=0.002,-0.001,0.003",
       [](Robot& r) {
         for (Cable& c : r.cables) c.platform_anchor_m += Vector3(0.002, -0.001, 0.003);
       }},
      {"mass=0.7", [](Robot& r) { r.platform.mass_kg += 0.7; }},
      {"centre_of_mass=0.01,-0.02,0.03",
       [](Robot& r) { r.platform.centre_of_mass_m += Vector3(0.01, -0.02, 0.03); }},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.effect);
    start({c.effect});
    const Rest a = look(), b = go(1);
    Robot real = robot;
    c.apply(real);
    finalise(real);
    const PlatformState state_a = platform_state(real, a.truth.pose);
    const PlatformState state_b = platform_state(real, b.truth.pose);
    EXPECT_CLOSE(change(a, b), state_b.length_m() - state_a.length_m(), 1e-6);
    EXPECT_CLOSE(b.sample.swivel_rad, state_b.swivel_rad(), 1e-9);
    EXPECT_LT(wrench_residual(real, state_b, b.truth.tension_N).norm(), 1e-3);
    // … and the nominal one is measurably wrong.
    EXPECT_GT(std::max((b.sample.swivel_rad - b.ideal.swivel_rad()).norm(), imbalance(b).norm()),
              1e-2);
  }
}

TEST_F(InjectedEffects, LoadCells) {
  start({"load_cell_bias=5,-8,0,12"});
  Rest r = go(1);
  EXPECT_CLOSE(r.sample.tension_N - r.truth.tension_N, Eigen::Vector4d(5, -8, 0, 12), 1e-3);
  EXPECT_CLOSE(r.sample.tension_N, plan.setpoint_N[1], 1e-3);  // the loop controls the readings
  start({"load_cell_gain=0.05,0.02,-0.03,0"});
  r = go(1);
  EXPECT_CLOSE(r.sample.tension_N.array(),
               r.truth.tension_N.array() * Eigen::Array4d(1.05, 1.02, 0.97, 1.0), 1e-3);
  start({"load_cell_drift=0.05"});
  r = go(1, 100.0);
  EXPECT_CLOSE(r.sample.tension_N, r.truth.tension_N + CableVector::Constant(4, 5.0), 1e-2);
}

TEST_F(InjectedEffects, LoadCellsTogetherReadAsTheCatalogueTakesThemApart) {
  start(
      {"load_cell_bias=5,-8,10,12", "load_cell_gain=0.05,0.02,-0.03,0.1", "load_cell_drift=0.05"});
  const Rest r = go(1, 100.0);
  Robot known = parse_robot(
      to_yaml(robot) +
          "effects: [{name: load_cell_gain, gain_error: [0.05, 0.02, -0.03, 0.1]}, "
          "{name: load_cell_bias, bias_N: [5, -8, 10, 12]}, {name: load_cell_drift, rate_N_s: "
          "0.05}]",
      "known");
  Log log;
  log.time_s = Eigen::VectorXd::LinSpaced(101, 0.0, 100.0);
  log.tension_N = r.sample.tension_N.transpose().replicate(101, 1);
  const KnownState state = with_known_effects(known, log);
  EXPECT_CLOSE(state.log.tension_N.row(100).transpose(), r.truth.tension_N, 1e-2);
  EXPECT_TRUE(state.robot.effects.empty());
}

TEST_F(InjectedEffects, WhatIsAskedForStandsInPlaceOfWhatTheRobotFileSays) {
  SimulatorOptions options = perfect();
  options.effects.push_back(parse_injected_effect("load_cell_bias=5,-8,0,12"));
  const Robot listing =
      parse_robot(to_yaml(robot) + "effects: [{name: load_cell_bias, bias_N: [4, 4, 4, 4]}]", "");
  Simulator other(listing, options);
  ASSERT_TRUE(other.reset(plan.setpoint_N[0]).found);
  EXPECT_CLOSE(other.read().tension_N - other.truth().tension_N, Eigen::Vector4d(5, -8, 0, 12),
               1e-3);
}

TEST_F(InjectedEffects, FaultsThatTheRobotFileListsAreThoseThatSetTheLogRight) {
  const Robot listing = parse_robot(
      to_yaml(robot) +
          "effects: [{name: cable_order, order: [2, 3, 1, 4], tension_order: [1, 2, 3, 4]}, "
          "{name: length_unit, factor: 0.001}, {name: angle_unit, factor: [0.0174532925, 1]}, "
          "{name: attitude_sign, sign: [1, -1, -1]}, {name: tension_unit, factor: 9.80665}, "
          "{name: length_factor, factor: [1, 0.0254, 1, 1]}, "
          "{name: swivel_factor, factor: [1, 1, 0.0174532925, 1]}, "
          "{name: tension_factor, factor: [1, 1, 1, 9.80665]}]",
      "");
  Simulator plain(robot, perfect()), faulty(listing, perfect());
  Log log;
  log.time_s = Eigen::VectorXd::Zero(1);
  ASSERT_TRUE(plain.reset(plan.setpoint_N[0]).found && faulty.reset(plan.setpoint_N[0]).found);
  log.length_m = faulty.read().length_m.transpose();
  log.swivel_rad = faulty.read().swivel_rad.transpose();
  log.tension_N = faulty.read().tension_N.transpose();
  log.roll_pitch_yaw_rad = faulty.read().roll_pitch_yaw_rad.transpose();
  const Log right = correct_readings(listing, log).value();
  EXPECT_CLOSE(right.length_m.row(0).transpose(), plain.read().length_m, 1e-6);
  EXPECT_CLOSE(right.swivel_rad.row(0).transpose(), plain.read().swivel_rad, 1e-6);
  EXPECT_CLOSE(right.tension_N.row(0).transpose(), plain.read().tension_N, 1e-6);
  EXPECT_CLOSE(right.roll_pitch_yaw_rad.row(0).transpose(), plain.read().roll_pitch_yaw_rad, 1e-9);
  EXPECT_CLOSE(log.tension_N.leftCols<3>() * 9.80665, plain.read().tension_N.head<3>().transpose(),
               1e-6);
}

TEST_F(InjectedEffects, ExternalForceIsFixedInTheWorldAtTheCentreOfMass) {
  start({"external_force=4,-3,2"});
  for (const std::size_t k : {1u, 6u}) {
    const Rest r = go(k);
    Vector6 wrench;
    const Vector3 force(4.0, -3.0, 2.0);
    wrench << force, r.ideal.centre_of_mass_arm_m.cross(force);
    EXPECT_LT((imbalance(r) - wrench).norm(), 1e-3);  // Ξᵀτ = f + F
  }
}

TEST_F(InjectedEffects, AnUmbilicalPullsAtItsPointAndNotEverywhereAlike) {
  start({"umbilical=4,-3,2,0.05,-0.04,0.1,6,5,3,1,-2,0.5"});
  Vector3 middle = Vector3::Zero();
  for (const Cable& c : robot.cables) middle += c.pulley.position_m / 4.0;
  Matrix3 stiffness;
  stiffness << 6.0, 1.0, -2.0, 1.0, 5.0, 0.5, -2.0, 0.5, 3.0;
  for (const std::size_t k : {1u, 6u}) {
    const Rest r = go(k);
    const Vector3 arm = r.ideal.centre_of_mass_arm_m + r.ideal.rotation * Vector3(0.05, -0.04, 0.1);
    const Vector3 force =
        Vector3(4.0, -3.0, 2.0) - stiffness * (r.truth.pose.position_m + arm - middle);
    Vector6 wrench;
    wrench << force, arm.cross(force);
    EXPECT_LT((imbalance(r) - wrench).norm(), 1e-3);
  }
}

TEST_F(InjectedEffects, AShiftedLoadWeighsElsewhereFromThenOn) {
  start({"load_shift=1,0.8,0.02,-0.01,0.03"});
  EXPECT_LT(imbalance(look()).norm(), 1e-3);
  const Rest r = go(0);
  const Vector3 up(0.0, 0.0, robot.gravity_m_s2);
  const Vector3 shift = r.ideal.rotation * Vector3(0.02, -0.01, 0.03);
  const double mass_kg = robot.platform.mass_kg;
  Vector6 wrench;
  wrench << -0.8 * up,
      -r.ideal.centre_of_mass_arm_m.cross(0.8 * up) - shift.cross((mass_kg + 0.8) * up);
  EXPECT_LT((imbalance(r) - wrench).norm(), 1e-3);
}

TEST_F(InjectedEffects, ATiltedFrameHangsAsideAndItsAhrsTellsTheVertical) {
  start({"base_tilt=0.03,-0.02"});
  const Rest r = go(6);
  const Eigen::Quaterniond level(
      Eigen::AngleAxisd(std::hypot(0.03, 0.02), Vector3(0.03, -0.02, 0.0).normalized()));
  // In the axes of the frame the weight points along the turned vertical.
  const double weight_N = robot.weight_N();
  const Vector3 pull = level.inverse() * Vector3(0.0, 0.0, -weight_N);
  Vector6 wrench;
  const Vector3 aside = pull - Vector3(0.0, 0.0, -weight_N);
  wrench << aside, r.ideal.centre_of_mass_arm_m.cross(aside);
  EXPECT_LT((imbalance(r) - wrench).norm(), 1e-3);
  const Eigen::Quaterniond read =
      rotation_from_euler(r.sample.roll_pitch_yaw_rad, robot.euler_convention);
  EXPECT_LT(read.angularDistance(level * r.truth.pose.rotation), 1e-9);
}

TEST_F(InjectedEffects, Attitude) {
  start({"ahrs_misalignment=0.02,-0.03,0.04"});
  Rest r = go(1);
  const Eigen::Quaterniond read =
      rotation_from_euler(r.sample.roll_pitch_yaw_rad, robot.euler_convention);
  const Eigen::Quaterniond expected = r.truth.pose.rotation * exp_so3({0.02, -0.03, 0.04});
  EXPECT_LT(read.angularDistance(expected), 1e-9);

  start({"attitude_scale=0.05,-0.04"});
  r = go(1);
  EXPECT_CLOSE(r.sample.roll_pitch_yaw_rad, r.euler.cwiseProduct(Vector3(1.05, 0.96, 1.0)), 1e-9);

  start({"yaw_drift=0.001"});
  r = go(1, 40.0);
  EXPECT_CLOSE(r.sample.roll_pitch_yaw_rad, r.euler + Vector3(0.0, 0.0, 0.04), 1e-6);

  start({"magnetic_disturbance=0.1,-0.05,0.02"});
  r = go(1);
  const double turned = Vector3(0.1, -0.05, 0.02).dot(r.truth.pose.position_m);
  EXPECT_CLOSE(r.sample.roll_pitch_yaw_rad, r.euler + Vector3(0.0, 0.0, turned), 1e-9);
}

TEST_F(InjectedEffects, ADelayIsOfOneSensorAlone) {
  constexpr std::array kDelays{"length_delay=0.12", "swivel_delay=0.12", "tension_delay=0.12",
                               "sensor_delay=0.12"};
  const auto moved = [&](const std::vector<std::string>& effects) {
    start(effects);
    simulator->command_tension(plan.setpoint_N[1]);
    std::vector<std::array<Eigen::VectorXd, kDelays.size()>> out;
    for (int i = 0; i < 200; ++i) {
      const auto& now = look().sample;
      out.push_back({now.length_m, now.swivel_rad, now.tension_N, now.roll_pitch_yaw_rad});
      simulator->advance(0.01);
    }
    return out;
  };
  const auto plain = moved({});
  for (std::size_t late = 0; late < kDelays.size(); ++late) {
    // Winches and plant go as without: what is read late steers nothing here.
    const auto seen = moved({kDelays[late]});
    EXPECT_GT((seen[100][late] - seen[88][late]).norm(), 1e-3) << "it did move";
    for (std::size_t i = 13; i < seen.size(); ++i) {
      for (std::size_t s = 0; s < kDelays.size(); ++s) {
        EXPECT_CLOSE(seen[i][s], plain[s == late ? i - 12 : i][s], 1e-9) << kDelays[late] << s;
      }
    }
  }
}

TEST_F(InjectedEffects, DiscreteMaps) {
  start({});
  const Rest plain_0 = look(), plain = go(1);
  start({"length_sign=1,-1,1,-1"});
  Rest a = look(), b = go(1);
  EXPECT_CLOSE(change(a, b).array(), Eigen::Array4d(1, -1, 1, -1) * change(plain_0, plain).array(),
               1e-9);
  start({"swivel_sign=-1,1,1,1"});
  b = go(1);
  EXPECT_CLOSE(b.sample.swivel_rad.array(),
               Eigen::Array4d(-1, 1, 1, 1) * plain.sample.swivel_rad.array(), 1e-9);
  start({"cable_order=2,3,1,4"});
  b = go(1);
  for (int i = 0; i < 4; ++i) {
    const int source = std::array{1, 2, 0, 3}[static_cast<std::size_t>(i)];
    EXPECT_NEAR(b.sample.length_m[i], plain.sample.length_m[source], 1e-9);
    EXPECT_NEAR(b.sample.swivel_rad[i], plain.sample.swivel_rad[source], 1e-9);
    EXPECT_NEAR(b.sample.tension_N[i], plain.sample.tension_N[i], 1e-9);  // in the drives
  }
  start({"length_unit=1000"});
  a = look(), b = go(1);
  EXPECT_CLOSE(change(a, b), 1000.0 * change(plain_0, plain), 1e-6);
  start({"angle_unit=57.29577951308232,1"});
  b = go(1);
  EXPECT_CLOSE(b.sample.swivel_rad, plain.sample.swivel_rad / kDegree, 1e-7);
  EXPECT_CLOSE(b.sample.roll_pitch_yaw_rad, plain.euler, 1e-9);
  start({"euler_convention=ZYX"});
  b = go(1);
  EXPECT_CLOSE(b.sample.roll_pitch_yaw_rad,
               euler_from_rotation(b.ideal.rotation, EulerConvention::ZYX), 1e-9);
  EXPECT_GT((b.sample.roll_pitch_yaw_rad - b.euler).norm(), 1e-3);
}

TEST_F(InjectedEffects, EventsHappenWhenAndWhereAsked) {
  start({"outlier=1,2,0.3"});
  simulator->advance(0.99);
  const double clean = simulator->read().length_m[1];
  simulator->advance(0.05);
  EXPECT_NEAR(simulator->read().length_m[1] - clean, 0.3, 1e-9);
  simulator->advance(0.1);
  EXPECT_NEAR(simulator->read().length_m[1], clean, 1e-9);

  // The encoder does not see what slips; the tension loop hauls it in again, and that it sees.
  start({"cable_slip=1,3,0.005"});
  const Rest before = look();
  const Rest after = go(0);
  EXPECT_CLOSE(change(before, after), Eigen::Vector4d(0, 0, -0.005, 0), 1e-5);
  EXPECT_CLOSE(ideal_change(before, after), CableVector::Zero(4), 1e-5);

  const auto misread_N = [](const Rest& r) {
    return CableVector(r.sample.tension_N - r.truth.tension_N);
  };
  start({"load_cell_shift=1,2,7"});
  EXPECT_CLOSE(misread_N(look()), CableVector::Zero(4), 1e-9);
  EXPECT_CLOSE(misread_N(go(0)), Eigen::Vector4d(0, 7, 0, 0), 1e-9);

  start({"swivel_shift=1,2,0.03"});
  const Rest unmoved = look();
  EXPECT_NEAR(go(0).sample.swivel_rad[1] - unmoved.sample.swivel_rad[1], 0.03, 1e-9);
  start({"ahrs_shift=1,0.02,0,0"});
  const Vector3 knocked_rad = go(0).sample.roll_pitch_yaw_rad - unmoved.sample.roll_pitch_yaw_rad;
  EXPECT_NEAR(knocked_rad.norm(), 0.02, 2e-3);  // the platform leans, and shares it among angles

  start({"slack=1,1,0.4"});
  simulator->advance(0.99);
  EXPECT_GT(simulator->truth().tension_N[0], 50.0);
  simulator->advance(0.02);
  EXPECT_EQ(simulator->truth().tension_N[0], 0.0);
  EXPECT_NEAR(simulator->read().length_m[0] - before.sample.length_m[0], 0.4, 1e-6);

  start({"oscillation=1,1,2"});
  simulator->advance(0.99);
  EXPECT_LT(simulator->truth().twist.norm(), 1e-6);
  simulator->advance(0.02);
  EXPECT_GT(simulator->truth().twist.head<3>().norm(), 0.05);
}

TEST_F(InjectedEffects, OutsideTheCatalogue) {
  start({"bent_frame_under_load=2e-5"});
  // Each pulley gives way by 2e-5 m/N along its cable.
  const Rest unloaded = look();
  Rest r = go(5);
  const CableVector given_m = 2e-5 * (r.truth.tension_N - unloaded.truth.tension_N);
  EXPECT_CLOSE(change(unloaded, r), ideal_change(unloaded, r) - given_m, 1e-5);
  EXPECT_GT(given_m.cwiseAbs().maxCoeff(), 3e-4);

  start({"temperature_step=10,20"});
  const Rest cold = look();
  simulator->hold();
  simulator->advance(9.0);
  EXPECT_CLOSE(look().ideal.length_m(), cold.ideal.length_m(), 1e-7);
  simulator->advance(200.0);
  r = look();
  EXPECT_GT((r.ideal.length_m() - cold.ideal.length_m()).minCoeff(), 1e-4);
  EXPECT_CLOSE(r.sample.tension_N - r.truth.tension_N, CableVector::Constant(4, 4.0), 1e-2);

  start({"drum_runout=0.002,0.3"});
  const Rest a = look(), b = go(5);
  const CableVector error = change(a, b) - ideal_change(a, b);
  EXPECT_GT(error.cwiseAbs().maxCoeff(), 2e-4);
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 4.1e-3);
}

TEST_F(InjectedEffects, TheOneOfTheExtensionPageActsInARun) {
  const InjectableEffect row = rows_of_the_page().at(0);
  EXPECT_EQ(row.name, swivel_drift()->name());
  const std::vector<double> rate_rad_s{1e-3, -2e-3, 0.0, 4e-3};
  PlantParameters plant = plant_parameters(robot, perfect());
  PlantValues values(rate_rad_s, 4);
  row.act(values, plant);
  simulator = std::make_unique<Simulator>(plant, perfect());
  commanded_N = plan.setpoint_N[0];
  ASSERT_TRUE(simulator->reset(commanded_N).found);
  EXPECT_CLOSE(look().sample.swivel_rad, look().ideal.swivel_rad(), 1e-9);
  const Rest after = go(1, 20.0);
  EXPECT_CLOSE(after.sample.swivel_rad - after.ideal.swivel_rad(),
               20.0 * Eigen::Vector4d(1e-3, -2e-3, 0.0, 4e-3), 1e-9);
}

TEST_F(InjectedEffects, ALogOfEveryEffectIsComplete) {
  StartUpPlan brief = plan;
  brief.setpoint_N.resize(2);
  const std::vector<std::string> all{"transmission_ratio=0.01",
                                     "cable_elasticity=60000",
                                     "cable_creep=0.002",
                                     "cable_sag=0.03",
                                     "pulley_friction=0.02",
                                     "bending_hysteresis=1,0.01",
                                     "swivel_hysteresis=0.005",
                                     "swivel_scale=0.02",
                                     "pulley_radius=0.0003",
                                     "pulley_diameter=-0.005",
                                     "frame_anchors=0.002,0.001,-0.003",
                                     "frame_scale=0.001,-0.001,0.002",
                                     "frame_shear=0.002,0.001,-0.001",
                                     "frame_warp=0.002",
                                     "platform_anchors=0.001,0.001,-0.002",
                                     "load_cell_bias=3,-2,4,-5",
                                     "load_cell_gain=0.02",
                                     "load_cell_drift=0.02",
                                     "mass=0.2",
                                     "centre_of_mass=0.003,0.002,0.01",
                                     "external_force=1,-1,2",
                                     "umbilical=1,1,-1,0.02,0.03,0.05,2,2,1,0.5,0,0",
                                     "base_tilt=0.01,-0.01",
                                     "ahrs_misalignment=0.01,0.01,0.01",
                                     "attitude_scale=0.02,-0.02",
                                     "yaw_drift=0.0002",
                                     "magnetic_disturbance=0.02,0.03,0.01",
                                     "sensor_delay=0.05",
                                     "length_delay=0.05",
                                     "swivel_delay=0.05",
                                     "tension_delay=0.05"};
  StartUpRunOptions options;
  for (const std::string& text : all) {
    options.simulator.effects.push_back(parse_injected_effect(text));
  }
  const StartUpRun run = simulate_startup(robot, brief, options);
  EXPECT_EQ(run.state, StartUpState::done) << run.reason;
  EXPECT_TRUE(run.log.length_m.allFinite() && run.log.swivel_rad.allFinite() &&
              run.log.tension_N.allFinite() && run.log.roll_pitch_yaw_rad.allFinite());
}

}  // namespace
}  // namespace cdprcal::test
