// Eq. 6 as it stands: all six balance equations at the measured tensions, whitened.
#pragma once

#include "cdprcal/calibration/residuals/residual.hpp"

namespace cdprcal {

/// W (Ξᵀτ*_i − f(ζi)), 6 rows: forces then moments about P, world axes. Block: ζi.
/// W is the inverse square root of the covariance Ξᵀ diag(σ_τ²) Ξ + model noise; it is held
/// constant within a solve and refreshed between solves (PoseCache::update_wrench_whitening).
class WrenchResidual final : public ceres::SizedCostFunction<6, kPoseBlockSize> {
 public:
  WrenchResidual(const PoseCache& cache, std::size_t pose) : cache_(cache), pose_(pose) {}

  bool Evaluate(const double* const*, double* residuals, double** jacobians) const override {
    const PoseEvaluation& pose = cache_[pose_];
    if (!pose.valid) return false;
    const Matrix6& whitening = cache_.wrench_whitening(pose_);
    Eigen::Map<Vector6> out(residuals);
    out.noalias() = whitening * pose.wrench;
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      fill_pose_jacobian(jacobians[0], Matrix6(whitening * pose.wrench_by_twist));
    }
    return true;
  }

 private:
  const PoseCache& cache_;
  const std::size_t pose_;
};

}  // namespace cdprcal
