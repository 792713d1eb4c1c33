// Natural frequencies against closed forms and against properties that any oscillator has.
#include "cdprcal/statics/natural_frequencies.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "../support/plan_robots.hpp"
#include "cdprcal/equilibria/direct.hpp"

namespace cdprcal {
namespace {

/// A body on one cable from an eyelet: a double pendulum in every vertical plane, free to spin.
Robot hanging_body(double mass_kg, double arm_m, double inertia_kg_m2) {
  Robot robot;
  robot.name = "pendulum";
  robot.platform.mass_kg = mass_kg;
  robot.platform.centre_of_mass_m = {0.0, 0.0, -arm_m};
  robot.platform.inertia_kg_m2 = inertia_kg_m2 * Matrix3::Identity();
  Cable cable;
  cable.pulley.position_m = {0.01, 0.0, 3.0};  // off the eyelet's swivel axis, a horizontal one
  cable.pulley.axes_world << Vector3::UnitZ(), Vector3::UnitX().cross(Vector3::UnitZ()),
      Vector3::UnitX();
  robot.cables.push_back(cable);
  robot.tension_min_N = 1.0;
  robot.tension_max_N = 1000.0;
  finalise(robot);
  return robot;
}

TEST(NaturalFrequencies, ABodyOnOneLockedCableIsADoublePendulum) {
  const double m = 7.0, arm = 0.4, inertia = 0.3, cable = 1.5, g = 9.81;
  const Robot robot = hanging_body(m, arm, inertia);
  Pose pose;
  pose.position_m = {0.01, 0.0, 3.0 - cable};
  const PlatformState state = platform_state(robot, pose);
  ASSERT_TRUE(state.valid);
  const CableVector tension = CableVector::Constant(1, m * g);
  ASSERT_LT(wrench_residual(robot, state, tension).norm(), 1e-9);
  // Angles of cable and body from the vertical: kinetic and potential energy of the textbook.
  Eigen::Matrix2d mass, stiffness;
  mass << m * cable * cable, m * cable * arm, m * cable * arm, m * arm * arm + inertia;
  stiffness << m * g * cable, 0.0, 0.0, m * g * arm;
  const Eigen::Vector2d expected =
      Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix2d>(stiffness, mass)
          .eigenvalues()
          .cwiseSqrt() /
      (2.0 * kPi);
  const ModeVector found = free_motion_modes(robot, state, tension).natural_frequency_hz;
  ASSERT_EQ(found.size(), 5);
  EXPECT_NEAR(found[0], 0.0, 1e-6);  // spin about the vertical
  for (int k = 0; k < 2; ++k) {
    EXPECT_NEAR(found[1 + k], expected[0], 1e-9);
    EXPECT_NEAR(found[3 + k], expected[1], 1e-9);
  }
}

TEST(NaturalFrequencies, MassMatrixIsThatOfTheMassPointsOfABody) {
  // Four equal mass points make any inertia tensor that is a tetrahedron's; compare energies.
  test::Rng rng(3);
  for (int trial = 0; trial < 20; ++trial) {
    Robot robot = load_robot("irma4");
    std::array<Vector3, 4> points;
    Vector3 centre = Vector3::Zero();
    for (Vector3& p : points) {
      p = test::uniform_vector(rng, Vector3::Constant(-0.3), Vector3::Constant(0.3));
      centre += 0.25 * p;
    }
    const double m = 2.5;
    robot.platform.mass_kg = 4.0 * m;
    robot.platform.centre_of_mass_m = centre;
    robot.platform.inertia_kg_m2.setZero();
    for (const Vector3& p : points) {
      const Matrix3 arm = skew(p - centre);
      robot.platform.inertia_kg_m2 -= m * arm * arm;
    }
    finalise(robot);
    const Pose pose = test::random_pose(rng, robot);
    Vector6 twist;
    for (double& t : twist) t = test::uniform(rng, -1.0, 1.0);
    double energy = 0.0;
    for (const Vector3& p : points) {
      const Vector3 velocity = twist.head<3>() + twist.tail<3>().cross(Vector3(pose.rotation * p));
      energy += 0.5 * m * velocity.squaredNorm();
    }
    const Matrix6 mass = mass_matrix(robot, platform_state(robot, pose));
    EXPECT_NEAR(0.5 * twist.dot(mass * twist), energy, 1e-12 * std::max(1.0, energy));
  }
}

TEST(NaturalFrequencies, SolveTheEigenproblemAndInterlace) {
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver(robot);
  for (const SetPoint& s :
       test::set_points_in(solver, *published_measurement_box(robot), {3, 3, 3})) {
    const PlatformState state = platform_state(robot, s.pose);
    const Modes all = constant_tension_modes(robot, state, s.tension_N);
    const Modes free = free_motion_modes(robot, state, s.tension_N);
    ASSERT_EQ(all.natural_frequency_hz.size(), 6);
    ASSERT_EQ(free.natural_frequency_hz.size(), 2);
    const Matrix6 k = stiffness(robot, state, s.tension_N);
    const Matrix6 m = mass_matrix(robot, state);
    for (int i = 0; i < 6; ++i) {
      const double omega = 2.0 * kPi * all.natural_frequency_hz[i];
      const Vector6 v = all.shape.col(i);
      EXPECT_LT((k * v - omega * omega * m * v).norm(), 1e-8 * (k * v).norm());
      EXPECT_NEAR(v.dot(m * v), 1.0, 1e-10);
    }
    // Rayleigh: locking n cables moves frequency i up, but not beyond the old one i + n.
    for (int i = 0; i < 2; ++i) {
      EXPECT_GE(free.natural_frequency_hz[i], all.natural_frequency_hz[i]);
      EXPECT_LE(free.natural_frequency_hz[i], all.natural_frequency_hz[i + 4]);
      EXPECT_LT((length_jacobian(state) * free.shape.col(i)).norm(), 1e-12);
    }
  }
}

TEST(NaturalFrequencies, SixCablesLeaveNoFreeMotion) {
  test::Rng rng(4);
  const Robot robot = test::random_robot(rng, 6);
  const PlatformState state = platform_state(robot, test::random_pose(rng, robot));
  EXPECT_EQ(free_motion_modes(robot, state, test::random_tensions(rng, robot))
                .natural_frequency_hz.size(),
            0);
}

TEST(NaturalFrequencies, AnUnstableEquilibriumHasNone) {
  // Upside down: the centre of mass above the anchor of the only cable.
  Robot robot = hanging_body(5.0, 0.3, 0.2);
  Pose pose;
  pose.position_m = {0.01, 0.0, 1.5};
  pose.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(kPi, Vector3::UnitX()));
  const CableVector tension = CableVector::Constant(1, robot.weight_N());
  const Modes modes = free_motion_modes(robot, platform_state(robot, pose), tension);
  EXPECT_TRUE(std::isnan(modes.natural_frequency_hz[0]));
  EXPECT_FALSE(std::isnan(modes.natural_frequency_hz[4]));
}

}  // namespace
}  // namespace cdprcal
