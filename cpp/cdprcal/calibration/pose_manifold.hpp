// SE(3) for Ceres: seven numbers, six degrees of freedom.
#pragma once

#include <ceres/manifold.h>

#include "cdprcal/calibration/pose_cache.hpp"

namespace cdprcal {

/// x ⊕ δ is geometry's `plus`. The residuals hand over derivatives along δ directly, in the first
/// six columns of their seven-column blocks, so ∂plus/∂δ is [I₆; 0] by construction: the exact
/// derivative of F(x ⊕ δ) at δ = 0 without the detour through quaternion derivatives.
class PoseManifold final : public ceres::Manifold {
 public:
  [[nodiscard]] int AmbientSize() const override { return kPoseBlockSize; }
  [[nodiscard]] int TangentSize() const override { return 6; }

  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const PoseBlock block = to_block(plus(from_block(x), Eigen::Map<const Vector6>(delta)));
    Eigen::Map<PoseBlock>{x_plus_delta} = block;
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kPoseBlockSize, 6, Eigen::RowMajor>>{jacobian}.setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector6>{y_minus_x} = minus(from_block(y), from_block(x));
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, kPoseBlockSize, Eigen::RowMajor>>{jacobian}.setIdentity();
    return true;
  }
};

}  // namespace cdprcal
