#include "cdprcal/statics/wrench.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "../support/numeric_jacobian.hpp"
#include "../support/random_robot.hpp"
#include "../support/table2.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal {
namespace {

using test::derivative_cases;
using test::jacobian_matches;
using test::numeric_pose_hessian;
using test::numeric_pose_jacobian;
using test::Rng;

double potential(const Robot& robot, const Pose& pose, const CableVector& tension) {
  return potential_energy(robot, pose, platform_state(robot, pose), tension);
}

/// The stable equilibrium of irma4 at given tensions near a pose: Newton on the potential.
Pose settle(const Robot& robot, Pose pose, const CableVector& tension) {
  for (int i = 0; i < 50; ++i) {
    const PlatformState state = platform_state(robot, pose);
    const Vector6 step =
        -solve_square(stiffness(robot, state, tension), wrench_residual(robot, state, tension));
    pose = plus(pose, step);
    if (step.norm() < 1e-14) break;
  }
  return pose;
}

TEST(Wrench, StructureMatrixIsTransposedLengthJacobianWithColumnsOfEquation7) {
  for (const auto& [robot, pose, label] : derivative_cases()) {
    SCOPED_TRACE(label);
    const PlatformState state = platform_state(robot, pose);
    const WrenchMatrix structure = structure_matrix(state);
    EXPECT_EQ(structure, WrenchMatrix(length_jacobian(state).transpose()));
    for (int i = 0; i < state.cable_count; ++i) {
      const Vector3 t = state.cable[i].direction;
      const Vector3 arm = pose.rotation * robot.cables[i].platform_anchor_m;
      EXPECT_LE((structure.col(i).head<3>() - t).norm(), 1e-15);
      EXPECT_LE((structure.col(i).tail<3>() - arm.cross(t)).norm(), 1e-14);
    }
  }
}

TEST(Wrench, ResidualIsTheGradientOfThePotential) {
  Rng rng(41);
  for (const auto& [robot, pose, label] : derivative_cases()) {
    SCOPED_TRACE(label);
    const CableVector tension = test::random_tensions(rng, robot);
    const auto numeric =
        numeric_pose_jacobian([&](const Pose& p) { return potential(robot, p, tension); }, pose);
    const Vector6 residual = wrench_residual(robot, platform_state(robot, pose), tension);
    EXPECT_TRUE(jacobian_matches(residual.transpose(), numeric, 1e-9));
  }
}

TEST(Wrench, StiffnessIsTheDerivativeOfTheResidual) {
  Rng rng(42);
  for (const auto& [robot, pose, label] : derivative_cases()) {
    SCOPED_TRACE(label);
    const CableVector tension = test::random_tensions(rng, robot);
    const PlatformState state = platform_state(robot, pose);
    EXPECT_TRUE(jacobian_matches(stiffness(robot, state, tension),
                                 numeric_pose_jacobian(
                                     [&](const Pose& p) {
                                       return wrench_residual(robot, platform_state(robot, p),
                                                              tension);
                                     },
                                     pose)));
    EXPECT_TRUE(jacobian_matches(tension_stiffness(state, tension),
                                 numeric_pose_jacobian(
                                     [&](const Pose& p) {
                                       return Vector6(structure_matrix(platform_state(robot, p)) *
                                                      tension);
                                     },
                                     pose)));
    EXPECT_TRUE(jacobian_matches(gravity_stiffness(robot, state),
                                 numeric_pose_jacobian(
                                     [&](const Pose& p) {
                                       return Vector6(
                                           -gravity_wrench(robot, platform_state(robot, p)));
                                     },
                                     pose)));
  }
}

TEST(Wrench, SymmetricPartOfTheStiffnessIsTheHessianOfThePotential) {
  Rng rng(43);
  for (const auto& [robot, pose, label] : derivative_cases()) {
    SCOPED_TRACE(label);
    const CableVector tension = test::random_tensions(rng, robot);
    const Matrix6 k = stiffness(robot, platform_state(robot, pose), tension);
    const auto numeric =
        numeric_pose_hessian([&](const Pose& p) { return potential(robot, p, tension); }, pose);
    EXPECT_TRUE(jacobian_matches(0.5 * (k + k.transpose()), numeric, 1e-6));
  }
}

TEST(Wrench, AtAnEquilibriumTheStiffnessItselfIsTheHessianAndEquationA5HasTheOtherSign) {
  const Robot robot = load_robot("irma4");
  for (const test::Table2Row& row : test::kTable2) {
    const CableVector tension = row.tension();
    const Pose pose = settle(robot, row.pose(), tension);
    const PlatformState state = platform_state(robot, pose);
    ASSERT_LE(wrench_residual(robot, state, tension).norm(), 1e-10);
    const Matrix6 k = stiffness(robot, state, tension);
    EXPECT_LE((k - k.transpose()).norm(), 1e-10 * k.norm());
    const auto hessian =
        numeric_pose_hessian([&](const Pose& p) { return potential(robot, p, tension); }, pose);
    EXPECT_TRUE(jacobian_matches(k, hessian, 1e-6));
    // Eq. A5 as printed: Q = +s̃′g̃. Its sum with K is symmetric too, but it is no Hessian.
    Matrix6 printed = tension_stiffness(state, tension);
    printed.bottomRightCorner<3, 3>() +=
        skew(state.centre_of_mass_arm_m) * skew(robot.gravity_force_N());
    EXPECT_LE((printed - printed.transpose()).norm(), 1e-10 * k.norm());
    EXPECT_FALSE(jacobian_matches(printed, hessian, 1e-6));
  }
}

TEST(Wrench, TensionStiffnessIsKOfEquationA5) {
  Rng rng(44);
  for (const auto& [robot, pose, label] : derivative_cases()) {
    SCOPED_TRACE(label);
    const CableVector tension = test::random_tensions(rng, robot);
    const PlatformState state = platform_state(robot, pose);
    Matrix6 k = Matrix6::Zero();
    for (int i = 0; i < state.cable_count; ++i) {
      const Matrix3 t = direction_by_q(state.cable[i]);
      const Matrix3 a = skew(state.anchor_arm_m[i]);
      Matrix6 first, second = Matrix6::Zero();
      first << t, -t * a, a * t, -a * t * a;
      second.bottomRightCorner<3, 3>() = skew(state.cable[i].direction) * a;
      k += tension[i] * (first + second);
    }
    EXPECT_LE((tension_stiffness(state, tension) - k).norm(), 1e-13 * k.norm());
  }
}

TEST(Wrench, FreeMotionsAreAnOrthonormalBasisThatMovesNoCable) {
  for (const auto& [robot, pose, label] : derivative_cases()) {
    SCOPED_TRACE(label);
    const PlatformState state = platform_state(robot, pose);
    const Eigen::MatrixXd basis = free_motion_basis(state);
    ASSERT_EQ(basis.rows(), 6);
    ASSERT_EQ(basis.cols(), std::max(0, 6 - robot.cable_count()));
    EXPECT_LE(
        (basis.transpose() * basis - Eigen::MatrixXd::Identity(basis.cols(), basis.cols())).norm(),
        1e-13);
    EXPECT_LE((length_jacobian(state) * basis).norm(), 1e-13);
  }
}

TEST(Wrench, FreeMotionStiffnessIsEquationA4) {
  Rng rng(45);
  for (const auto& [robot, pose, label] : derivative_cases()) {
    SCOPED_TRACE(label);
    const CableVector tension = test::random_tensions(rng, robot);
    const PlatformState state = platform_state(robot, pose);
    const Eigen::MatrixXd free = free_motion_stiffness(robot, state, tension);
    ASSERT_EQ(free.cols(), std::max(0, 6 - robot.cable_count()));
    EXPECT_EQ(free, Eigen::MatrixXd(free.transpose()));
    const Eigen::MatrixXd basis = free_motion_basis(state);
    const auto hessian =
        numeric_pose_hessian([&](const Pose& p) { return potential(robot, p, tension); }, pose);
    if (free.size() == 0) continue;
    const Eigen::MatrixXd expected = basis.transpose() * hessian.value * basis;
    EXPECT_LE((free - expected).norm(), 1e-5 * hessian.value.norm());
  }
}

TEST(Wrench, Table2PosesAreStable) {
  const Robot robot = load_robot("irma4");
  for (const test::Table2Row& row : test::kTable2) {
    const PlatformState state = platform_state(robot, row.pose());
    const Eigen::MatrixXd free = free_motion_stiffness(robot, state, row.tension());
    ASSERT_EQ(free.cols(), 2);
    const Eigen::VectorXd moments = free.selfadjointView<Eigen::Lower>().eigenvalues();
    EXPECT_GT(moments.minCoeff(), 0.0);
  }
}

TEST(Wrench, TensionsAreOneACable) {
  const Robot robot = load_robot("irma4");
  const Pose pose = test::kTable2[0].pose();
  const PlatformState state = platform_state(robot, pose);
  for (const int size : {0, 2, 5}) {
    const CableVector tension = CableVector::Ones(size);
    EXPECT_THROW(wrench_residual(robot, state, tension), InputError);
    EXPECT_THROW(tension_stiffness(state, tension), InputError);
    EXPECT_THROW(potential_energy(robot, pose, state, tension), InputError);
  }
}

}  // namespace
}  // namespace cdprcal
