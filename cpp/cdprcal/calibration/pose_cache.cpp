#include "cdprcal/calibration/pose_cache.hpp"

#include <Eigen/Cholesky>

namespace cdprcal {

PoseBlock to_block(const Pose& pose) {
  PoseBlock block;
  block << pose.position_m, pose.rotation.coeffs();
  return block;
}

Pose from_block(const double* block) {
  Pose pose;
  pose.position_m = Eigen::Map<const Vector3>(block);
  pose.rotation = Eigen::Map<const Eigen::Quaterniond>(block + 3);
  return pose;
}

PoseCache::PoseCache(const CalibrationProblem& problem, const std::vector<Pose>& poses)
    : problem_(problem),
      robot_(with_effects(problem.robot, problem.effects)),
      evaluations_(poses.size()),
      whitening_(poses.size(), Matrix6::Identity()) {
  blocks_.reserve(poses.size());
  for (const Pose& pose : poses) blocks_.push_back(to_block(pose));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Measurement& measurement = problem.measurements[i];
    const bool rests = measurement.kind == PoseKind::static_pose &&
                       (i > 0 || problem.reference_statics) && measurement.tension_N.allFinite();
    statics_.push_back(rests ? problem.statics : StaticsModel::none);
  }
}

void PoseCache::PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) {
  if (!new_evaluation_point) return;
  // With derivatives even where only the cost is asked for: nearly every step is accepted, and the
  // derivatives are wanted at the same point next.
  static_cast<void>(evaluate_jacobians);
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    evaluate_pose(robot_, problem_.measurements[i], pose(i), statics_[i],
                  problem_.left_inverse_rows, problem_.effects, true, evaluations_[i]);
  }
}

void PoseCache::update_wrench_whitening(double graduation) {
  const SensorSigma& sigma = problem_.robot.sigma;
  tension_weight_ = 1.0 / (graduation * sigma.tension_N);
  Vector6 model_variance;
  model_variance << Vector3::Constant(sigma.wrench_force_N * sigma.wrench_force_N),
      Vector3::Constant(sigma.wrench_moment_Nm * sigma.wrench_moment_Nm);
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (statics_[i] != StaticsModel::wrench) continue;
    const PlatformState state = platform_state(robot_, pose(i));
    if (!state.valid) continue;
    const WrenchMatrix structure = structure_matrix(state);
    Matrix6 covariance = sigma.tension_N * sigma.tension_N * structure * structure.transpose();
    covariance.diagonal() += model_variance;
    // C = L Lᵀ ⇒ ‖L⁻¹ r‖² = rᵀ C⁻¹ r
    const Matrix6 root = covariance.llt().matrixL();
    whitening_[i] =
        root.triangularView<Eigen::Lower>().solve(Matrix6::Identity()) / graduation;
  }
}

}  // namespace cdprcal
