// F_σ of eqs 13, 16: swivel-angle changes, n rows [rad/σ].
#pragma once

#include "cdprcal/calibration/residuals/residual.hpp"

namespace cdprcal {

/// F_σ,i = σ(ζi) − σ(ζ0) − Δσ*_i, wrapped to (−π, π]. Blocks: ζ0, ζi, reference error (n).
class SwivelResidual final : public RelativeResidual {
 public:
  using RelativeResidual::RelativeResidual;
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    if (!valid()) return false;
    const PoseEvaluation& pose = cache_[pose_];
    const PoseEvaluation& reference = cache_[0];
    return fill(pose.swivel_rad, reference.swivel_rad, pose.swivel_by_twist,
                reference.swivel_by_twist, true, parameters[2], residuals, jacobians);
  }
};

}  // namespace cdprcal
