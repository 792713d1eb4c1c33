#include "cdprcal/estimation/curvature.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/estimation/assembly.hpp"
#include "cdprcal/kinematics/motion.hpp"

namespace cdprcal {

double variance_ratio_nearby(const CalibrationProblem& problem, const CalibrationResult& result) {
  constexpr double kReach = 2.0;  // σ
  const SymmetricEigen<Matrix6> eigen(*result.covariance);
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
    const SymmetricEigen<Eigen::MatrixXd> ratio = symmetric_eigen<Eigen::MatrixXd>(
        basis.transpose() * *there * basis, basis.transpose() * *result.covariance * basis);
    largest =
        std::max({largest, ratio.eigenvalues().maxCoeff(), 1.0 / ratio.eigenvalues().minCoeff()});
  }
  return largest;
}

namespace {

/// Least cost with ζ0 held along one of the platform's freedoms and free along those `beside` it;
/// NaN where the geometry ends.
double cost_beside(const Eigen::MatrixXd& beside, Assembly& assembly) {
  constexpr int kMostSteps = 8;
  constexpr double kSettled = 0.01;
  double cost = kNaN;
  for (int i = 0; i < kMostSteps; ++i) {
    const MinimiserSummary held =
        assembly.minimise({.max_iterations = 50, .function_tolerance = 1e-6}, true);
    if (!held.usable) return kNaN;
    const std::vector<PoseRows> rows = assembly.rows();
    if (rows.empty()) return kNaN;
    // All else is at its best: ζ0 moves the cost by its own rows alone.
    const PoseRows& own = rows.front();
    Vector6 gradient = Vector6::Zero();
    for (std::size_t r = 0; r < static_cast<std::size_t>(own.count); ++r) {
      gradient += own.residual[r] * Eigen::Map<const Vector6>(own.own[r].data());
    }
    const Matrix6 information = assembly.reference_information().information;
    const Eigen::VectorXd slope = beside.transpose() * gradient;
    const Eigen::VectorXd step =
        -least_norm(Eigen::MatrixXd(beside.transpose() * information * beside), slope);
    const double decrease = -0.5 * slope.dot(step);
    cost = held.cost - decrease;
    if (!(decrease > kSettled)) break;
    assembly.poses().set_pose(0, plus(assembly.poses().pose(0), beside * step));
  }
  return cost;
}

/// By what factor on its σ the readings leave a rotation open: the cost rises by less than t²/2.
/// `reach`: one σ of it, and how ζ0 goes with it.
double widening_along(const CalibrationProblem& problem, const CalibrationResult& result,
                      const Vector6& held, const Vector6& reach) {
  constexpr double kUnbelievable = 8.0;  // of cost: 4 σ
  const TwistBasis basis = motion_basis(problem.robot);
  const Eigen::MatrixXd beside =
      basis * householder_q(basis.transpose() * held).rightCols(basis.cols() - 1);
  std::vector<double> distances{2.0, 4.0, 6.0};
  for (const double turn_deg : {15.0, 30.0}) {  // valleys of lengths lie about that far apart
    const double distance = turn_deg * kDegree / held.dot(reach);
    if (distance > distances.back()) distances.push_back(distance);
  }
  double widening = 1.0;
  for (const double distance : distances) {
    for (const double away : {distance, -distance}) {
      std::vector<Pose> poses = result.poses;  // all together, over walls between valleys
      for (Pose& pose : poses) pose = plus(pose, away * reach);
      Assembly assembly(problem, poses);
      assembly.set_reference_errors(result.reference_errors);
      assembly.poses().update_wrench_weights(1.0);
      const double rise = cost_beside(beside, assembly) - result.cost;
      // Where the geometry ends, so does any doubt.
      if (!std::isfinite(rise) || rise > kUnbelievable) continue;
      if (!(rise > 0.0)) return std::numeric_limits<double>::infinity();
      widening = std::max(widening, distance / std::sqrt(2.0 * rise));
    }
  }
  return widening;
}

}  // namespace

Nearby nearby(const CalibrationProblem& problem, const CalibrationResult& result) {
  const Matrix6& covariance = *result.covariance;
  const SymmetricEigen<Matrix3> rotation(covariance.bottomRightCorner<3, 3>());
  const Vector3 sigma_rad = rotation.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  Nearby out;
  out.covariance = covariance;
  if (!(sigma_rad[2] > kFarRotation_rad)) return out;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(sigma_rad[axis] > 1e-3 * sigma_rad[2])) continue;  // guides hold it
    Vector6 held = Vector6::Zero();
    held.tail<3>() = rotation.eigenvectors().col(axis);
    const Vector6 reach = covariance * held / sigma_rad[axis];
    const double widening = widening_along(problem, result, held, reach);
    out.widening = std::max(out.widening, widening);
    out.covariance += (widening * widening - 1.0) * reach * reach.transpose();
  }
  return out;
}

}  // namespace cdprcal
