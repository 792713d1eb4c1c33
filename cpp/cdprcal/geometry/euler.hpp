// Tait–Bryan angles as data: six intrinsic orders, and how the angles move with the pose.
//
// roll turns about X, pitch about Y, yaw about Z, whatever the order; the order says which comes
// first. "XYZ" means R = Rx(roll) Ry(pitch) Rz(yaw). The paper says ZYX; its recorded results
// reproduce only with XYZ, so the convention belongs to each sensor and is never assumed.
#pragma once

#include <array>
#include <string>

#include "cdprcal/geometry/pose.hpp"

namespace cdprcal {

enum class EulerConvention { XYZ, XZY, YXZ, YZX, ZXY, ZYX };

/// "XYZ" … ↔ enum; throws InputError naming the accepted orders.
EulerConvention parse_euler_convention(const std::string& name);
std::string to_string(EulerConvention convention);
/// Axes of the first, second and third turn: 0 = X, 1 = Y, 2 = Z.
std::array<int, 3> euler_axes(EulerConvention convention);

/// (roll, pitch, yaw) [rad] → R_world_platform.
Eigen::Quaterniond rotation_from_euler(const Vector3& roll_pitch_yaw_rad,
                                       EulerConvention convention);

/// R_world_platform → (roll, pitch, yaw) [rad]: the middle angle in [−π/2, π/2].
/// At ±π/2 (gimbal lock) the last angle is returned as 0.
Vector3 euler_from_rotation(const Matrix3& rotation, EulerConvention convention);

/// H of ω_world = H · (roll rate, pitch rate, yaw rate): column a is the axis that angle a turns
/// about. Its inverse is ∂(roll, pitch, yaw)/∂δθ; singular at gimbal lock.
Matrix3 euler_rate_matrix(const Vector3& roll_pitch_yaw_rad, EulerConvention convention);

/// H and ∂H/∂δθ: derivative[j] = ∂(column j of H)/∂δθ (3×3).
struct EulerRateDerivative {
  Matrix3 rate_matrix;
  Matrix3 column_derivative[3];
};
EulerRateDerivative euler_rate_derivative(const Vector3& roll_pitch_yaw_rad,
                                          EulerConvention convention);

}  // namespace cdprcal
