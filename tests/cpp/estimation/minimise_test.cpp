// Our minimiser against dense algebra and against Ceres.
#include "cdprcal/estimation/minimise.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>

#include "cdprcal/estimation/assembly.hpp"
#include "scenario.hpp"

namespace cdprcal::test {
namespace {

/// Rows with random numbers: some of the offsets, then some of their own.
PoseRows random_rows(int offsets, int own, double share, RandomNormal& random) {
  PoseRows rows;
  const auto add = [&](int offset) {
    const auto r = static_cast<std::size_t>(rows.count++);
    rows.residual[r] = random();
    for (double& v : rows.own[r]) v = random();
    rows.offset[r] = offset;
    rows.by_offset[r] = offset < 0 ? 0.0 : random();
  };
  for (int k = 0; k < offsets; ++k) {
    if (std::abs(random()) < share) add(k);
  }
  for (int i = 0; i < own; ++i) add(-1);
  return rows;
}

TEST(PoseElimination, IsTheSchurComplementOfTheDenseNormalEquations) {
  for (const int offsets : {1, 9, 17}) {
    for (const int poses : {0, 1, 7, 8, 9, 30}) {
      SCOPED_TRACE(std::to_string(offsets) + " offsets, " + std::to_string(poses) + " poses");
      RandomNormal random(static_cast<std::uint64_t>(100 * offsets + poses));
      constexpr double kDamping = 0.3;
      const Eigen::Index size = 6 * poses + offsets;
      Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(size, size);
      Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
      PoseElimination elimination(static_cast<std::size_t>(poses), offsets, true);
      elimination.begin(1.0);
      elimination.add(random_rows(offsets, 3, 1.0, random));  // forgotten at the next begin
      elimination.begin(kDamping);
      double cost = 0.0;
      for (int i = 0; i < poses; ++i) {
        const PoseRows rows = random_rows(offsets, 6 + i % 3, 1.0, random);
        elimination.add(rows);
        for (std::size_t r = 0; r < static_cast<std::size_t>(rows.count); ++r) {
          Eigen::VectorXd row = Eigen::VectorXd::Zero(size);
          row.segment<6>(6 * i) = Eigen::Map<const Vector6>(rows.own[r].data());
          if (rows.offset[r] >= 0) row[6 * poses + rows.offset[r]] = rows.by_offset[r];
          hessian += row * row.transpose();
          gradient += row * rows.residual[r];
          cost += 0.5 * rows.residual[r] * rows.residual[r];
        }
      }
      const EliminatedSums& sums = elimination.finish();
      EXPECT_NEAR(sums.cost, cost, 1e-12 * (1.0 + cost));
      EXPECT_TRUE(sums.raw_gradient.isApprox(gradient.tail(offsets), 1e-12));
      EXPECT_TRUE(sums.raw_diagonal.isApprox(hessian.diagonal().tail(offsets), 1e-12));

      Eigen::MatrixXd damped = hessian;
      damped.diagonal().head(6 * poses) *= 1.0 + kDamping;
      const auto own = damped.topLeftCorner(6 * poses, 6 * poses);
      const auto cross = damped.topRightCorner(6 * poses, offsets);
      const Eigen::LLT<Eigen::MatrixXd> factor(own);
      const Eigen::VectorXd own_gradient = gradient.head(6 * poses);
      Eigen::MatrixXd information = damped.bottomRightCorner(offsets, offsets);
      Eigen::VectorXd reduced = gradient.tail(offsets);
      if (poses > 0) {
        information -= cross.transpose() * factor.solve(cross.eval());
        reduced -= cross.transpose() * factor.solve(own_gradient);
        EXPECT_NEAR(sums.decrease, 0.5 * own_gradient.dot(factor.solve(own_gradient)), 1e-9);
        EXPECT_DOUBLE_EQ(sums.largest_gradient, own_gradient.cwiseAbs().maxCoeff());
      }
      EXPECT_LT((sums.information - information).norm(), 1e-10 * (1.0 + hessian.norm()));
      EXPECT_LT((sums.gradient - reduced).norm(), 1e-10 * (1.0 + gradient.norm()));

      Eigen::VectorXd offset_step(offsets);
      for (double& v : offset_step) v = random();
      const PoseSteps steps = elimination.back_substitute(offset_step);
      if (poses == 0) continue;
      const Eigen::VectorXd expected = -factor.solve(own_gradient + cross * offset_step);
      double damping = 0.0;
      for (int i = 0; i < poses; ++i) {
        const double* const at =
            elimination.steps(static_cast<std::size_t>(i) / lanes::kLanes) + i % lanes::kLanes;
        const Vector6 step = Eigen::Map<const Vector6, 0, Eigen::InnerStride<lanes::kLanes>>(at);
        EXPECT_LT((step - expected.segment<6>(6 * i)).norm(), 1e-9 * (1.0 + expected.norm()));
        damping += step.cwiseAbs2().dot(hessian.diagonal().segment<6>(6 * i));
      }
      EXPECT_NEAR(steps.squared_norm, expected.squaredNorm(), 1e-9 * expected.squaredNorm());
      EXPECT_NEAR(steps.damping, damping, 1e-9 * damping);
    }
  }
}

TEST(PoseElimination, APoseThatFewReadingsSeeSaysNothingOfWhatItLeavesOpen) {
  // Three rows cannot determine six unknowns: they are absorbed, and nothing reaches the offsets.
  RandomNormal random(5);
  PoseElimination elimination(2, 9, false);
  elimination.begin(1e-14);
  for (int i = 0; i < 2; ++i) {
    PoseRows rows = random_rows(3, 0, 1e9, random);
    ASSERT_EQ(rows.count, 3);
    elimination.add(rows);
  }
  const EliminatedSums& sums = elimination.finish();
  EXPECT_TRUE(sums.information.allFinite());
  EXPECT_LT(sums.information.norm(), 1e-9);
}

/// Both minimisers from the same start.
void compare(const CalibrationProblem& problem, const std::vector<Pose>& guess) {
  SolveOptions by_ceres;
  by_ceres.minimiser = MinimiserKind::ceres;
  const CalibrationResult theirs = solve(problem, guess, by_ceres);
  const CalibrationResult ours = solve(problem, guess);
  // A minimum that is too curved to be claimed (left inverse with an unknown reference) is one.
  ASSERT_EQ(ours.status, theirs.status) << ours.reason << "\n" << theirs.reason;
  ASSERT_EQ(ours.poses.size(), guess.size());
  // The weights of the balance are renewed until ζ0 settles: that is how far the costs agree.
  EXPECT_NEAR(ours.cost, theirs.cost, 1e-7 * (1.0 + theirs.cost));
  for (std::size_t i = 0; i < guess.size(); ++i) {
    EXPECT_LT(minus(ours.poses[i], theirs.poses[i]).norm(), 1e-6) << "pose " << i;
  }
  EXPECT_LT((ours.reference_errors - theirs.reference_errors).norm(), 1e-6);
  ASSERT_EQ(ours.covariance.has_value(), theirs.covariance.has_value());
  if (ours.covariance) {
    EXPECT_TRUE(ours.covariance->isApprox(*theirs.covariance, 1e-5));
  }
}

class BothMinimisers : public ::testing::TestWithParam<StaticsModel> {};

TEST_P(BothMinimisers, EndAtTheSameMinimum) {
  for (const bool full : {false, true}) {
    Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.2, 11);
    s.problem.statics = GetParam();
    s.problem.reference_attitude = s.problem.reference_statics = s.problem.reference_noise = full;
    SCOPED_TRACE(full ? "with the reference's noise" : "as in the paper");
    compare(s.problem, disturbed(s.truth, 0.05, 3.0 * kDegree, 2));
  }
}

TEST_P(BothMinimisers, EndAtTheSameMinimumWithReadingsMissing) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.2, 12);
  s.problem.statics = GetParam();
  std::vector<Measurement>& m = s.problem.measurements;
  m[2].length_m[1] = kNaN;
  m[3].swivel_rad.setConstant(kNaN);
  m[4].roll_pitch_yaw_rad.setConstant(kNaN);
  m[5].kind = PoseKind::kinematic_pose;
  m[0].swivel_rad[2] = kNaN;  // changes then count from the second reading
  compare(s.problem, disturbed(s.truth, 0.05, 3.0 * kDegree, 3));
}

INSTANTIATE_TEST_SUITE_P(Statics, BothMinimisers,
                         ::testing::Values(StaticsModel::none, StaticsModel::left_inverse,
                                           StaticsModel::wrench));

TEST(Minimiser, HoldsTheInitialPoseWhereAsked) {
  const Scenario s =
      scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 1.0, 4);
  const std::vector<Pose> guess = disturbed(s.truth, 0.02, 1.0 * kDegree, 5);
  const CalibrationProblem problem = completed(s.problem, guess);
  Assembly assembly(problem, guess);
  assembly.cache().update_wrench_whitening(1.0);
  const double before = assembly.cost();
  const MinimiserSummary summary = Minimiser(assembly).minimise({.hold_initial_pose = true});
  EXPECT_TRUE(summary.converged);
  EXPECT_EQ(assembly.cache().pose(0).position_m, guess[0].position_m);
  EXPECT_EQ(assembly.cache().pose(0).rotation.coeffs(), guess[0].rotation.coeffs());
  const double held = assembly.cost();
  EXPECT_LT(held, before);
  Minimiser(assembly).minimise({});
  EXPECT_LT(assembly.cost(), held);
}

TEST(Minimiser, AStateOutsideTheGeometryIsNotUsable) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.0, 4);
  std::vector<Pose> guess = s.truth;
  guess[3].position_m.setConstant(kNaN);
  const CalibrationProblem problem = completed(s.problem, s.truth);
  Assembly assembly(problem, guess);
  EXPECT_FALSE(Minimiser(assembly).minimise({}).usable);
  EXPECT_TRUE(std::isnan(assembly.cost()));
}

TEST(Minimiser, StopsAfterTheIterationsAllowed) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 1.0, 4);
  const std::vector<Pose> guess = disturbed(s.truth, 0.05, 3.0 * kDegree, 5);
  const CalibrationProblem problem = completed(s.problem, guess);
  Assembly assembly(problem, guess);
  assembly.cache().update_wrench_whitening(100.0);
  const MinimiserSummary summary = Minimiser(assembly).minimise({.max_iterations = 1});
  EXPECT_TRUE(summary.usable);
  EXPECT_FALSE(summary.converged);
  EXPECT_LE(summary.evaluations, 2);
}

}  // namespace
}  // namespace cdprcal::test
