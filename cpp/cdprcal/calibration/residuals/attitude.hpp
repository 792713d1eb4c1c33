// F_ε of eqs 13, 16: absolute roll and pitch (2 rows), yaw change (1 row) [rad/σ].
#pragma once

#include "cdprcal/calibration/residuals/residual.hpp"

namespace cdprcal {

/// φ(ζi) − φ*_i and θ(ζi) − θ*_i, in the sensor's own Euler convention. Block: ζi.
class RollPitchResidual final : public ceres::SizedCostFunction<2, kPoseBlockSize> {
 public:
  RollPitchResidual(const PoseCache& cache, std::size_t pose, const Vector3& measured_rad,
                    double sigma)
      : cache_(cache), pose_(pose), measured_rad_(measured_rad), weight_(1.0 / sigma) {}

  bool Evaluate(const double* const*, double* residuals, double** jacobians) const override {
    const PoseEvaluation& pose = cache_[pose_];
    if (!pose.valid) return false;
    Eigen::Vector2d weight;
    for (int a = 0; a < 2; ++a) {
      const bool present = std::isfinite(measured_rad_[a]);
      weight[a] = present ? weight_ : 0.0;
      residuals[a] =
          present ? weight_ * wrap_angle(pose.roll_pitch_yaw_rad[a] - measured_rad_[a]) : 0.0;
    }
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      fill_pose_jacobian(jacobians[0], weight.asDiagonal() * pose.attitude_by_twist.topRows<2>());
    }
    return true;
  }

 private:
  const PoseCache& cache_;
  const std::size_t pose_;
  const Vector3 measured_rad_;
  const double weight_;
};

/// χ(ζi) − χ(ζ0) − Δχ*_i. Blocks: ζ0, ζi, error of the reference reading (1).
class YawResidual final : public RelativeResidual {
 public:
  using RelativeResidual::RelativeResidual;
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    if (!valid()) return false;
    const PoseEvaluation& pose = cache_[pose_];
    const PoseEvaluation& reference = cache_[0];
    const CableVector modelled = CableVector::Constant(1, pose.roll_pitch_yaw_rad[2]);
    const CableVector initial = CableVector::Constant(1, reference.roll_pitch_yaw_rad[2]);
    const Eigen::Matrix<double, 1, 6> by_twist = pose.attitude_by_twist.row(2);
    const Eigen::Matrix<double, 1, 6> reference_by_twist = reference.attitude_by_twist.row(2);
    return fill(modelled, initial, by_twist, reference_by_twist, true, parameters[2], residuals,
                jacobians);
  }
};

}  // namespace cdprcal
