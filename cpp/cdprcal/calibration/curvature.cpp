#include "cdprcal/calibration/curvature.hpp"

#include <ceres/solver.h>

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "cdprcal/calibration/assembly.hpp"

namespace cdprcal {

double variance_ratio_nearby(const CalibrationProblem& problem, const CalibrationResult& result) {
  constexpr double kReach = 2.0;  // σ
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(*result.covariance);
  const Vector6 worst = eigen.eigenvectors().col(5) * std::sqrt(eigen.eigenvalues()[5]);
  double largest = 1.0;
  for (const double sign : {1.0, -1.0}) {
    std::vector<Pose> poses = result.poses;
    poses.front() = plus(poses.front(), sign * kReach * worst);
    Assembly assembly(problem, poses);
    assembly.set_reference_errors(result.reference_errors);
    assembly.cache().update_wrench_whitening(1.0);
    assembly.ceres_problem().SetParameterBlockConstant(assembly.cache().block(0));
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering = assembly.elimination_order();
    options.logging_type = ceres::SILENT;
    options.max_num_iterations = 50;
    options.function_tolerance = 1e-4;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &assembly.ceres_problem(), &summary);
    if (!summary.IsSolutionUsable()) continue;  // the geometry ends there, and so does any doubt
    const std::optional<Matrix6> there = assembly.reference_information().covariance;
    if (!there) return std::numeric_limits<double>::infinity();
    const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6> ratio(*there, *result.covariance);
    largest = std::max({largest, ratio.eigenvalues()[5], 1.0 / ratio.eigenvalues()[0]});
  }
  return largest;
}

}  // namespace cdprcal
