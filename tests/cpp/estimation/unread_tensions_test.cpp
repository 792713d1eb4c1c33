// Rests whose load cells are missing, all or some: the balance with the best tensions put in.
#include "cdprcal/estimation/unread_tensions.hpp"

#include <gtest/gtest.h>

#include "../support/numeric_jacobian.hpp"
#include "../support/random_robot.hpp"
#include "../support/scenario.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/estimation/assembly.hpp"
#include "cdprcal/statics/wrench.hpp"

namespace cdprcal::test {
namespace {

struct Case {
  Robot robot;
  Pose pose;
  CableVector tension_N;  ///< NaN: not read
  BalanceSigma sigma;
  int unread = 0;
};

Case random_case(Rng& rng) {
  Case out;
  const int cables = 1 + static_cast<int>(rng() % kMaxCables);
  out.robot = random_robot(rng, cables);
  out.pose = random_pose(rng, out.robot);
  out.tension_N = random_tensions(rng, out.robot);
  for (double& t : out.tension_N) {
    if (out.unread == 5 || rng() % 2 == 0) continue;
    t = kNaN;
    ++out.unread;
  }
  out.sigma = {CableVector::Zero(cables),
               Vector6::NullaryExpr([&] { return uniform(rng, 0.05, 0.5); })};
  for (double& s : out.sigma.tension_N) s = uniform(rng, 0.1, 5.0);
  return out;
}

PartialBalance balance_of(const Case& c, const Pose& pose) {
  const PlatformState state = platform_state(c.robot, pose);
  return partial_balance(state, c.tension_N, TwistBasis(6, 0), gravity_wrench(c.robot, state),
                         c.sigma);
}

/// ½ |W (Ξᵀτ − f)|².
double cost_of(const Case& c, const Pose& pose) {
  const PartialBalance at = balance_of(c, pose);
  const PlatformState state = platform_state(c.robot, pose);
  return 0.5 * (at.whitening * wrench_residual(c.robot, state, at.tension_N)).squaredNorm();
}

/// The same with an unread tension known to `wide` alone, by the covariance as it stands.
double cost_with_wide_tensions(const Case& c, double wide) {
  const PlatformState state = platform_state(c.robot, c.pose);
  const WrenchMatrix structure = structure_matrix(state);
  CableVector sigma = c.sigma.tension_N, tension_N = c.tension_N;
  for (Eigen::Index i = 0; i < sigma.size(); ++i) {
    if (std::isfinite(tension_N[i])) continue;
    sigma[i] = wide;
    tension_N[i] = 0.0;
  }
  Matrix6 covariance = structure * sigma.cwiseAbs2().asDiagonal() * structure.transpose();
  covariance.diagonal() += c.sigma.wrench.cwiseAbs2();
  const Vector6 residual = wrench_residual(c.robot, state, tension_N);
  return 0.5 * residual.dot(solve_symmetric(covariance, residual));
}

TEST(PartialBalance, IsTheBalanceWithTensionsOfUnboundedNoise) {
  Rng rng(1);
  for (int trial = 0; trial < 300; ++trial) {
    const Case c = random_case(rng);
    const double expected = cost_with_wide_tensions(c, 3e5 * c.sigma.wrench.maxCoeff());
    EXPECT_NEAR(cost_of(c, c.pose), expected, 1e-3 * (1.0 + expected)) << trial;
  }
}

TEST(PartialBalance, WhitensWhatIsLeftAndKeepsWhatIsRead) {
  Rng rng(2);
  for (int trial = 0; trial < 300; ++trial) {
    const Case c = random_case(rng);
    const PartialBalance at = balance_of(c, c.pose);
    const WrenchMatrix structure = structure_matrix(platform_state(c.robot, c.pose));
    EXPECT_EQ(at.whitening.topRows(c.unread).norm(), 0.0);
    Matrix6 covariance = Matrix6::Zero();
    for (Eigen::Index i = 0; i < c.tension_N.size(); ++i) {
      if (std::isfinite(c.tension_N[i])) {
        EXPECT_EQ(at.tension_N[i], c.tension_N[i]);
        const double s = c.sigma.tension_N[i];
        covariance += s * s * structure.col(i) * structure.col(i).transpose();
      } else {
        const double scale = 1.0 / c.sigma.wrench.minCoeff();
        EXPECT_LE((at.whitening * structure.col(i)).norm(), 1e-12 * scale);
      }
    }
    covariance.diagonal() += c.sigma.wrench.cwiseAbs2();
    Matrix6 expected = Matrix6::Identity();
    expected.topLeftCorner(c.unread, c.unread).setZero();
    EXPECT_LE((at.whitening * covariance * at.whitening.transpose() - expected).norm(), 1e-9);
  }
}

TEST(PartialBalance, ItsGradientIsThatAtTheBestTensions) {
  // With read tensions exact but for the model's own noise nothing else moves with the pose.
  Rng rng(3);
  for (int trial = 0; trial < 100; ++trial) {
    Case c = random_case(rng);
    c.sigma.tension_N.setConstant(1e-9);
    const PartialBalance at = balance_of(c, c.pose);
    const PlatformState state = platform_state(c.robot, c.pose);
    const Vector6 residual = at.whitening * wrench_residual(c.robot, state, at.tension_N);
    const Vector6 gradient =
        (at.whitening * stiffness(c.robot, state, at.tension_N)).transpose() * residual;
    for (int a = 0; a < 6; ++a) {
      const double step = 1e-6;
      const double slope = (cost_of(c, plus(c.pose, step * Vector6::Unit(a))) -
                            cost_of(c, plus(c.pose, -step * Vector6::Unit(a)))) /
                           (2.0 * step);
      EXPECT_NEAR(gradient[a], slope, 1e-5 * (1.0 + gradient.norm())) << trial;
    }
  }
}

TEST(UnreadTensions, RestsAloneFindThePoseThatLoadCellsFind) {
  Robot robot = load_robot("irma4");
  robot.sigma.length_m = 1e-3;  // with those of the paper nothing is known well without load cells
  robot.sigma.swivel_rad = robot.sigma.attitude_rad = 2e-3;
  Scenario s = scenario(robot, irma4_setpoints(), PoseKind::static_pose, 0.0, 4);
  for (Measurement& m : s.problem.measurements) m.tension_N.setConstant(kNaN);
  const CalibrationResult result = solve(s.problem, disturbed(s.truth, 0.05, 2.0 * kDegree, 6));
  ASSERT_EQ(result.status, CalibrationStatus::converged) << result.reason;
  EXPECT_LT(minus(result.poses[0], s.truth[0]).norm(), 1e-7);
  EXPECT_LT(result.residuals[2].wrench.norm(), 1e-5);

  // They say more than the geometry alone, and less than load cells.
  CalibrationProblem geometry = s.problem;
  geometry.statics = StaticsModel::none;
  const CalibrationResult without = solve(geometry, s.truth);
  const Scenario all = scenario(robot, irma4_setpoints(), PoseKind::static_pose, 0.0, 4);
  const CalibrationResult with = solve(all.problem, all.truth);
  for (int a = 0; a < 6; ++a) {
    EXPECT_LT(result.standard_deviation()[a], without.standard_deviation()[a]);
    EXPECT_GT(result.standard_deviation()[a], with.standard_deviation()[a]);
  }
}

TEST(UnreadTensions, OneDeadLoadCellCostsOneEquation) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.0, 4);
  for (Measurement& m : s.problem.measurements) m.tension_N[2] = kNaN;
  Assembly assembly(s.problem, s.truth);
  assembly.poses().update_wrench_whitening(1.0);
  for (const PoseRows& rows : assembly.rows()) {
    int balance = 0;
    for (int r = 0; r < rows.count; ++r) {
      balance += rows.label[static_cast<std::size_t>(r)].channel == Channel::balance ? 1 : 0;
    }
    EXPECT_EQ(balance, 5);
  }
  const CalibrationResult result = solve(s.problem, disturbed(s.truth, 0.02, kDegree, 6));
  ASSERT_EQ(result.status, CalibrationStatus::converged) << result.reason;
  EXPECT_LT(minus(result.poses[0], s.truth[0]).norm(), 1e-8);
}

}  // namespace
}  // namespace cdprcal::test
