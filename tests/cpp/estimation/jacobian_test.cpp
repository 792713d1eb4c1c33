// Every cost function's analytic Jacobian against the shared numeric harness.
#include <gtest/gtest.h>

#include "../support/numeric_jacobian.hpp"
#include "../support/random_robot.hpp"
#include "cdprcal/estimation/assembly.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal::test {
namespace {

/// Three poses of a robot with plausible readings; not equilibria: residuals must not vanish.
CalibrationProblem problem_at(const RobotPose& at, StaticsModel statics, Rng& rng,
                              std::vector<Pose>& poses) {
  CalibrationProblem problem;
  problem.robot = at.robot;
  problem.statics = statics;
  if (statics == StaticsModel::left_inverse) {
    problem.left_inverse_rows = left_inverse_rows(at.robot.cable_count());
  }
  RandomNormal random(rng());
  const ReadingOffsets offsets = random_offsets(at.robot.cable_count(), random);
  poses = {random_pose(rng, at.robot), at.pose, random_pose(rng, at.robot)};
  for (const Pose& pose : poses) {
    problem.measurements.push_back(
        synthetic_measurement(at.robot, pose, random_tensions(rng, at.robot), PoseKind::static_pose,
                              offsets, reading_noise(at.robot.sigma), random));
  }
  return problem;
}

Eigen::VectorXd residuals_at(const CalibrationProblem& problem,
                             const std::vector<Pose>& whitened_at, const std::vector<Pose>& poses) {
  // Whitening is a constant of a solve: taken where the Jacobian is, not where the residual is.
  Assembly assembly(problem, whitened_at);
  assembly.poses().update_wrench_whitening(1.0);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    assembly.poses().set_pose(i, poses[i]);
  }
  Eigen::VectorXd residuals;
  Eigen::MatrixXd jacobian;
  assembly.linearise(residuals, jacobian);
  return residuals;
}

void check_all(StaticsModel statics, int max_cables) {
  Rng rng(7);
  for (const RobotPose& at : derivative_cases(max_cables)) {
    SCOPED_TRACE(at.label);
    std::vector<Pose> poses;
    const CalibrationProblem problem = problem_at(at, statics, rng, poses);
    Assembly assembly(problem, poses);
    assembly.poses().update_wrench_whitening(1.0);
    Eigen::VectorXd residuals;
    Eigen::MatrixXd jacobian;
    assembly.linearise(residuals, jacobian);
    if (!residuals.allFinite() || residuals.cwiseAbs().maxCoeff() > 1e6) continue;  // near singular
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const NumericJacobian numeric = numeric_pose_jacobian(
          [&](const Pose& moved) {
            std::vector<Pose> trial = poses;
            trial[i] = moved;
            return residuals_at(problem, poses, trial);
          },
          poses[i], 1e-3);
      EXPECT_TRUE(
          jacobian_matches(jacobian.middleCols(6 * static_cast<Eigen::Index>(i), 6), numeric, 1e-6))
          << "pose " << i;
    }
  }
}

TEST(CalibrationJacobian, KinematicResiduals) { check_all(StaticsModel::none, kMaxCables); }
TEST(CalibrationJacobian, WrenchResiduals) { check_all(StaticsModel::wrench, kMaxCables); }
TEST(CalibrationJacobian, LeftInverseResiduals) { check_all(StaticsModel::left_inverse, 6); }

}  // namespace
}  // namespace cdprcal::test
