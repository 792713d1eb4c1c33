// The reference reading is one reading like any other: its error e has the sensor's σ.
#pragma once

#include <ceres/cost_function.h>

#include "cdprcal/types.hpp"

namespace cdprcal {

/// F_e = e / σ; rows without a reference reading are 0, their offset being free. Block: e.
/// Not in the paper, whose residuals all share the reference's noise without saying so.
class ReferenceErrorResidual final : public ceres::CostFunction {
 public:
  ReferenceErrorResidual(CableVector present, double sigma) : weight_(present / sigma) {
    set_num_residuals(static_cast<int>(weight_.size()));
    *mutable_parameter_block_sizes() = {static_cast<int>(weight_.size())};
  }

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Index rows = weight_.size();
    for (Eigen::Index i = 0; i < rows; ++i) residuals[i] = weight_[i] * parameters[0][i];
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> by_error(
          jacobians[0], rows, rows);
      by_error.setZero();
      by_error.diagonal() = weight_;
    }
    return true;
  }

 private:
  const CableVector weight_;  ///< 1/σ, or 0 where there is no reading
};

}  // namespace cdprcal
