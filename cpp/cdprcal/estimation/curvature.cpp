#include "cdprcal/estimation/curvature.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "cdprcal/estimation/assembly.hpp"
#include "cdprcal/kinematics/motion.hpp"

namespace cdprcal {

double variance_ratio_nearby(const CalibrationProblem& problem, const CalibrationResult& result) {
  constexpr double kReach = 2.0;  // σ
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(*result.covariance);
  const Vector6 worst = eigen.eigenvectors().col(5) * std::sqrt(eigen.eigenvalues()[5]);
  const TwistBasis basis = motion_basis(problem.robot);
  double largest = 1.0;
  for (const double sign : {1.0, -1.0}) {
    std::vector<Pose> poses = result.poses;
    poses.front() = plus(poses.front(), sign * kReach * worst);
    Assembly assembly(problem, poses);
    assembly.set_reference_errors(result.reference_errors);
    assembly.poses().update_wrench_weights(1.0);
    const MinimiserSummary summary =
        assembly.minimise({.max_iterations = 50, .function_tolerance = 1e-4}, true);
    if (!summary.usable) continue;  // the geometry ends there, and so does any doubt
    const std::optional<Matrix6> there = assembly.reference_information().covariance;
    if (!there) return std::numeric_limits<double>::infinity();
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> ratio(
        basis.transpose() * *there * basis, basis.transpose() * *result.covariance * basis);
    largest =
        std::max({largest, ratio.eigenvalues().maxCoeff(), 1.0 / ratio.eigenvalues().minCoeff()});
  }
  return largest;
}

}  // namespace cdprcal
