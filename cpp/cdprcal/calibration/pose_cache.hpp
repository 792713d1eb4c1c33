// All models and Jacobians at the current poses, evaluated once a step and read by every residual.
#pragma once

#include <ceres/evaluation_callback.h>

#include <array>
#include <vector>

#include "cdprcal/calibration/problem.hpp"

namespace cdprcal {

/// Ceres' parameter block of a pose: p, then the quaternion as (x, y, z, w).
inline constexpr int kPoseBlockSize = 7;
using PoseBlock = Eigen::Matrix<double, kPoseBlockSize, 1>;
PoseBlock to_block(const Pose& pose);
Pose from_block(const double* block);

/// Lower triangular L with L Lᵀ the covariance of the wrench balance at a pose: tensions with
/// σ_τ `tension_sigma_N` through the structure matrix, and the model's own wrench error.
Matrix6 balance_root(const PlatformState& state, double tension_sigma_N, const SensorSigma& sigma);

/// Holds the parameter blocks and their evaluations. ζ0 is evaluated once a step, however many
/// residuals refer to it. Residuals therefore are valid only for the state held here.
class PoseCache final : public ceres::EvaluationCallback {
 public:
  PoseCache(const CalibrationProblem& problem, const std::vector<Pose>& poses);

  void PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) override;

  double* block(std::size_t pose) { return blocks_[pose].data(); }
  [[nodiscard]] Pose pose(std::size_t index) const { return from_block(blocks_[index].data()); }
  [[nodiscard]] std::size_t size() const { return blocks_.size(); }
  [[nodiscard]] const PoseEvaluation& operator[](std::size_t pose) const {
    return evaluations_[pose];
  }
  /// 1/σ of a reading of a channel at a pose (the balance: of a tension, without graduation).
  [[nodiscard]] double weight(std::size_t pose, Channel channel) const {
    return weights_[pose][static_cast<std::size_t>(channel)];
  }
  [[nodiscard]] StaticsModel statics_of(std::size_t pose) const { return statics_[pose]; }

  /// Fixes the whitening of every wrench residual at the present poses: an inverse square root of
  /// graduation² · (σ_τ² ΞᵀΞ + diag(σ_f², σ_m²)). Its rows are the principal axes of the tensions'
  /// part in units of the model's own, so that each mixes the two in a known proportion.
  void update_wrench_whitening(double graduation);
  [[nodiscard]] const Matrix6& wrench_whitening(std::size_t pose) const { return whitening_[pose]; }
  /// Variance of a wrench row, before whitening and in units of the model's own, that one N² of
  /// tension variance makes: 0 for what no tension can balance.
  [[nodiscard]] double tension_gain(std::size_t pose, int row) const {
    return tension_gain_[pose][row];
  }
  /// 1/σ of tension residuals at the present graduation.
  [[nodiscard]] double tension_weight(std::size_t pose) const {
    return weight(pose, Channel::balance) / graduation_;
  }

 private:
  const CalibrationProblem& problem_;
  const Robot robot_;  ///< with the geometry of the effects
  std::vector<PoseBlock> blocks_;
  std::vector<StaticsModel> statics_;
  std::vector<PoseEvaluation> evaluations_;
  std::vector<PoseBlock> evaluated_at_;  ///< where evaluations_ belong; NaN: nowhere yet
  std::vector<Matrix6> whitening_;
  std::vector<Vector6> tension_gain_;
  std::vector<std::array<double, kChannels>> weights_;
  double graduation_ = 1.0;
  double wrench_force_N_ = 1.0, wrench_moment_Nm_ = 1.0;
};

}  // namespace cdprcal
