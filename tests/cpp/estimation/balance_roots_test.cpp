// How well the balance is known: what the model and the motion are wrong by, and the tensions.
#include "cdprcal/estimation/balance_roots.hpp"

#include <gtest/gtest.h>

#include "../support/random_robot.hpp"
#include "../support/scenario.hpp"
#include "cdprcal/estimation/assembly.hpp"
#include "cdprcal/statics/wrench.hpp"

namespace cdprcal::test {
namespace {

Vector6 random_sigma(Rng& rng) {
  return Vector6::NullaryExpr([&] { return uniform(rng, 0.05, 2.0); });
}

TEST(BalanceRoots, AreThoseOfTheCovarianceAxisByAxis) {
  Rng rng(7);
  for (int trial = 0; trial < 60; ++trial) {
    const Robot robot = random_robot(rng, 1 + trial % kMaxCables);
    std::vector<Pose> poses;
    std::vector<BalanceSigma> sigma;
    for (int i = 0; i < 11; ++i) {
      poses.push_back(random_pose(rng, robot));
      CableVector tension_N(robot.cable_count());
      for (double& s : tension_N) s = uniform(rng, 0.1, 5.0);
      sigma.push_back({tension_N, random_sigma(rng)});
    }
    const std::vector<Matrix6> roots = inverse_balance_roots(robot, poses, sigma);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const PlatformState state = platform_state(robot, poses[i]);
      if (!state.valid) continue;
      const WrenchMatrix structure = structure_matrix(state);
      Matrix6 covariance =
          structure * sigma[i].tension_N.cwiseAbs2().asDiagonal() * structure.transpose();
      covariance.diagonal() += sigma[i].wrench.cwiseAbs2();
      const Matrix6 unit = roots[i] * covariance * roots[i].transpose();
      EXPECT_LT((unit - Matrix6::Identity()).norm(), 1e-8) << trial;
    }
  }
}

TEST(BalanceRoots, WhatIsNotKnownOfTheMotionIsAddedInQuadrature) {
  const Vector6 sigma = wrench_sigma(3.0, 0.3, Vector6::Unit(2) * 4.0 + Vector6::Unit(5) * 0.4);
  EXPECT_TRUE(sigma.isApprox((Vector6() << 3.0, 3.0, 5.0, 0.3, 0.3, 0.5).finished()));
}

TEST(BalanceRoots, RowsSayWhichShareOfThemTheMotionMakes) {
  Rng rng(8);
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.0, 4);
  for (std::size_t i = 1; i < s.problem.measurements.size(); ++i) {
    s.problem.measurements[i].inertial_sigma = random_sigma(rng);
  }
  Assembly assembly(s.problem, s.truth);
  assembly.poses().update_wrench_whitening(1.0);
  for (const FittedRow& row : assembly.fitted_rows()) {
    if (row.label.channel != Channel::balance) continue;
    const Matrix6& whitening = assembly.poses().wrench_whitening(row.pose);
    const Vector6 weights = whitening.row(row.label.component);
    const auto variance = [&](const Vector6& sigma) {
      return weights.cwiseProduct(sigma).squaredNorm();
    };
    const Vector6 inertial = s.problem.measurements[row.pose].inertial_sigma;
    const SensorSigma& robot = s.problem.robot.sigma;
    const double rest =
        variance(wrench_sigma(robot.wrench_force_N, robot.wrench_moment_Nm, inertial));
    EXPECT_NEAR(row.inertial_share, variance(inertial) / rest, 1e-12);
    // Tensions make the rest of a row of unit variance.
    EXPECT_NEAR(rest * (1.0 + row.tension_gain * std::pow(robot.tension_N, 2)), 1.0, 1e-9);
  }
}

}  // namespace
}  // namespace cdprcal::test
