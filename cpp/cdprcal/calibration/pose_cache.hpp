// All models and Jacobians at the current poses, evaluated once a step and read by every residual.
#pragma once

#include <ceres/evaluation_callback.h>

#include <vector>

#include "cdprcal/calibration/problem.hpp"

namespace cdprcal {

/// Ceres' parameter block of a pose: p, then the quaternion as (x, y, z, w).
inline constexpr int kPoseBlockSize = 7;
using PoseBlock = Eigen::Matrix<double, kPoseBlockSize, 1>;
PoseBlock to_block(const Pose& pose);
Pose from_block(const double* block);

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
  [[nodiscard]] StaticsModel statics_of(std::size_t pose) const { return statics_[pose]; }

  /// Fixes the whitening of every wrench residual at the present poses: the inverse square root of
  /// graduation² · (Ξᵀ diag(σ_τ²) Ξ + diag(σ_f², σ_m²)).
  void update_wrench_whitening(double graduation);
  [[nodiscard]] const Matrix6& wrench_whitening(std::size_t pose) const {
    return whitening_[pose];
  }
  /// 1/σ of tension residuals at the present graduation.
  [[nodiscard]] const double& tension_weight() const { return tension_weight_; }

 private:
  const CalibrationProblem& problem_;
  const Robot robot_;  ///< with the geometry of the effects
  std::vector<PoseBlock> blocks_;
  std::vector<StaticsModel> statics_;
  std::vector<PoseEvaluation> evaluations_;
  std::vector<Matrix6> whitening_;
  double tension_weight_ = 0.0;
};

}  // namespace cdprcal
