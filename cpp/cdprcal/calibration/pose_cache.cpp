#include "cdprcal/calibration/pose_cache.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

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
      evaluated_at_(poses.size(), PoseBlock::Constant(kNaN)),
      whitening_(poses.size(), Matrix6::Identity()),
      tension_gain_(poses.size(), Vector6::Zero()) {
  blocks_.reserve(poses.size());
  for (const Pose& pose : poses) blocks_.push_back(to_block(pose));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Measurement& measurement = problem.measurements[i];
    const bool counts = measurement.in_balance() && (i > 0 || problem.reference_statics);
    statics_.push_back(counts ? problem.statics : StaticsModel::none);
  }
  const NoiseModel noise = problem.noise.value_or(specified_noise(problem.robot.sigma));
  wrench_force_N_ = noise.wrench_force_N;
  wrench_moment_Nm_ = noise.wrench_moment_Nm;
  for (const Measurement& measurement : problem.measurements) {
    auto& weights = weights_.emplace_back();
    for (std::size_t c = 0; c < kChannels; ++c) {
      weights[c] = 1.0 / noise.channel[c].sigma(measurement.samples);
    }
  }
}

void PoseCache::PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) {
  if (!new_evaluation_point) return;
  // With derivatives even where only the cost is asked for: nearly every step is accepted, and the
  // derivatives are wanted at the same point next.
  static_cast<void>(evaluate_jacobians);
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (evaluated_at_[i] == blocks_[i]) continue;
    evaluated_at_[i] = blocks_[i];
    evaluate_pose(robot_, problem_.measurements[i], pose(i), statics_[i],
                  problem_.left_inverse_rows, problem_.effects, true, evaluations_[i]);
  }
}

Matrix6 balance_root(const PlatformState& state, double tension_sigma_N, const SensorSigma& sigma) {
  const WrenchMatrix structure = structure_matrix(state);
  Matrix6 covariance = tension_sigma_N * tension_sigma_N * structure * structure.transpose();
  covariance.diagonal().head<3>().array() += sigma.wrench_force_N * sigma.wrench_force_N;
  covariance.diagonal().tail<3>().array() += sigma.wrench_moment_Nm * sigma.wrench_moment_Nm;
  return covariance.llt().matrixL();
}

void PoseCache::update_wrench_whitening(double graduation) {
  graduation_ = graduation;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (statics_[i] != StaticsModel::wrench) continue;
    const PlatformState state = platform_state(robot_, pose(i));
    if (!state.valid) continue;
    Vector6 scale;
    scale << Vector3::Constant(1.0 / wrench_force_N_), Vector3::Constant(1.0 / wrench_moment_Nm_);
    const WrenchMatrix structure = scale.asDiagonal() * structure_matrix(state);
    const Matrix6 gram = structure * structure.transpose();
    const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(gram);
    tension_gain_[i] = eigen.eigenvalues().cwiseMax(0.0);
    const double tension_sigma_N = 1.0 / weight(i, Channel::balance);
    const Vector6 variance = (tension_sigma_N * tension_sigma_N * tension_gain_[i]).array() + 1.0;
    whitening_[i] = (graduation * variance.cwiseSqrt()).cwiseInverse().asDiagonal() *
                    eigen.eigenvectors().transpose() * scale.asDiagonal();
  }
}

}  // namespace cdprcal
