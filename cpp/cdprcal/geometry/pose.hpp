// Platform pose on SE(3) and its tangent.
//
// A small motion is a world-frame twist δ = (δp, δθ): p ← p + δp, R ← exp(δθ) R.
// It is the dual of the wrench about P in world axes, so ∂l/∂δ is the structure matrix itself.
#pragma once

#include <Eigen/Geometry>

#include "cdprcal/types.hpp"

namespace cdprcal {

/// Pose of the platform frame P in the world frame O: x_world = position_m + rotation · x_platform.
struct Pose {
  Vector3 position_m = Vector3::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< R_world_platform, unit norm

  [[nodiscard]] Matrix3 rotation_matrix() const { return rotation.toRotationMatrix(); }
};

/// exp: rotation vector [rad] → quaternion.
Eigen::Quaterniond exp_so3(const Vector3& rotation_vector_rad);
/// log: quaternion → rotation vector [rad], of norm ≤ π.
Vector3 log_so3(const Eigen::Quaterniond& rotation);

/// Left Jacobian of SO(3): exp(φ + δ) = exp(J(φ) δ) exp(φ) to first order of δ (Barfoot, State
/// Estimation for Robotics, eq. 7.77).
Matrix3 left_jacobian_so3(const Vector3& rotation_vector_rad);

/// pose ⊕ δ with δ = (δp [m], δθ [rad]) in world axes.
Pose plus(const Pose& pose, const Vector6& twist);
/// The δ for which `from` ⊕ δ = `to`.
Vector6 minus(const Pose& to, const Pose& from);

/// Geodesic angle [rad] between two orientations.
double rotation_distance_rad(const Pose& a, const Pose& b);
/// |α_a − α_b| [rad], paper eq. 20. Not a distance between rotations; kept to compare with the
/// paper.
double rotation_angle_difference_rad(const Pose& a, const Pose& b);

/// Nearest rotation (least squares) to a 3×3 matrix; throws InputError when R Rᵀ is farther than
/// 1e-6 from the identity, or the matrix mirrors.
Eigen::Quaterniond rotation_from_matrix(const Matrix3& matrix);

/// The shortest rotation that turns one direction into another; their lengths do not matter.
Eigen::Quaterniond rotation_between(const Vector3& from, const Vector3& to);

}  // namespace cdprcal
