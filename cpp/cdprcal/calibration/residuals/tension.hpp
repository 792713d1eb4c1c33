// F_τ of eqs 10–13: tensions by the paper's left inverse, n rows [N/σ].
#pragma once

#include "cdprcal/calibration/residuals/residual.hpp"

namespace cdprcal {

/// F_τ,i = τ(ζi) − τ*_i with τ(ζ) of eqs 11, 12. Block: ζi. σ follows the graduation.
class TensionResidual final : public ceres::CostFunction {
 public:
  TensionResidual(const PoseCache& cache, std::size_t pose, CableVector measured_N)
      : cache_(cache), pose_(pose), measured_N_(std::move(measured_N)) {
    set_num_residuals(static_cast<int>(measured_N_.size()));
    *mutable_parameter_block_sizes() = {kPoseBlockSize};
  }

  bool Evaluate(const double* const*, double* residuals, double** jacobians) const override {
    const PoseEvaluation& pose = cache_[pose_];
    if (!pose.valid) return false;
    const double weight = cache_.tension_weight();
    Eigen::Map<Eigen::VectorXd>(residuals, measured_N_.size()) =
        weight * (pose.tension_N - measured_N_);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      fill_pose_jacobian(jacobians[0], weight * pose.tension_by_twist);
    }
    return true;
  }

 private:
  const PoseCache& cache_;
  const std::size_t pose_;
  const CableVector measured_N_;
};

}  // namespace cdprcal
