// What the residuals of eq. 13 share: parameter blocks, cached evaluations, missing readings.
#pragma once

#include <ceres/sized_cost_function.h>

#include "cdprcal/calibration/pose_cache.hpp"

namespace cdprcal {

/// A Jacobian block with respect to a pose as Ceres wants it: one column more than the tangent.
/// PoseManifold (pose_manifold.hpp) has ∂plus/∂δ = [I₆; 0], so the first six columns are the
/// derivative along a world-frame twist and the last is never used.
using PoseJacobianMap =
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, kPoseBlockSize, Eigen::RowMajor>>;

template <typename Jacobian>
void fill_pose_jacobian(double* block, const Jacobian& by_twist) {
  PoseJacobianMap map(block, by_twist.rows(), kPoseBlockSize);
  map.template leftCols<6>() = by_twist;
  map.col(6).setZero();
}

/// A reading relative to the reference, of one group of channels (lengths or swivels of all
/// cables, or yaw):  F = (m(ζi) − m(ζ0) − Δ* − e) / σ, where e is the error of the reference
/// reading (absent in the paper: held at 0 there). Rows whose Δ* is NaN are 0.
/// Parameter blocks: ζ0, ζi, e.
class RelativeResidual : public ceres::CostFunction {
 public:
  RelativeResidual(const PoseCache& cache, std::size_t pose, CableVector change, double sigma)
      : cache_(cache), pose_(pose), change_(std::move(change)), weight_(1.0 / sigma) {
    set_num_residuals(static_cast<int>(change_.size()));
    *mutable_parameter_block_sizes() = {kPoseBlockSize, kPoseBlockSize,
                                        static_cast<int>(change_.size())};
  }

 protected:
  /// `modelled`, `reference`: m(ζi), m(ζ0); jacobians by twist; `wrap` for angles.
  template <typename Jacobian>
  bool fill(const CableVector& modelled, const CableVector& reference,
            const Jacobian& modelled_by_twist, const Jacobian& reference_by_twist, bool wrap,
            const double* reference_error, double* residuals, double** jacobians) const {
    const Eigen::Index rows = change_.size();
    CableVector weight(rows);
    for (Eigen::Index i = 0; i < rows; ++i) {
      const bool present = std::isfinite(change_[i]);
      weight[i] = present ? weight_ : 0.0;
      double value = modelled[i] - reference[i] - change_[i] - reference_error[i];
      if (wrap) value = wrap_angle(value);
      residuals[i] = present ? weight_ * value : 0.0;
    }
    if (jacobians == nullptr) return true;
    const auto by_row = weight.asDiagonal();
    if (jacobians[0] != nullptr) fill_pose_jacobian(jacobians[0], -(by_row * reference_by_twist));
    if (jacobians[1] != nullptr) fill_pose_jacobian(jacobians[1], by_row * modelled_by_twist);
    if (jacobians[2] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> by_error(
          jacobians[2], rows, rows);
      by_error.setZero();
      by_error.diagonal() = -weight;
    }
    return true;
  }

  [[nodiscard]] bool valid() const { return cache_[0].valid && cache_[pose_].valid; }

  const PoseCache& cache_;
  const std::size_t pose_;
  const CableVector change_;
  const double weight_;
};

}  // namespace cdprcal
