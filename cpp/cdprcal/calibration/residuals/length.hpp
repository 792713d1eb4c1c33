// F_l of eqs 13, 16: cable-length changes, n rows [m/σ].
#pragma once

#include "cdprcal/calibration/residuals/residual.hpp"

namespace cdprcal {

/// F_l,i = l(ζi) − l(ζ0) − Δl*_i. Blocks: ζ0, ζi, error of the reference readings (n).
class LengthResidual final : public RelativeResidual {
 public:
  using RelativeResidual::RelativeResidual;
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    if (!valid()) return false;
    const PoseEvaluation& pose = cache_[pose_];
    const PoseEvaluation& reference = cache_[0];
    return fill(pose.length_m, reference.length_m, pose.length_by_twist,
                reference.length_by_twist, false, parameters[2], residuals, jacobians);
  }
};

}  // namespace cdprcal
