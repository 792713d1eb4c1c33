// Shared vector types. SI units throughout; frames are in the names.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>

namespace cdprcal {

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// The most cables a robot may have: per-cable arrays have this capacity and never allocate.
inline constexpr int kMaxCables = 8;

/// One number a cable.
using CableVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxCables, 1>;
/// One row of six (a twist or its dual) a cable: Jacobians with respect to the platform pose.
using CableJacobian = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor, kMaxCables, 6>;
/// Six rows, one column a cable: the structure matrix Ξᵀ.
using WrenchMatrix = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMaxCables>;
/// Cables by cables.
using CableMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxCables, kMaxCables>;

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kDegree = kPi / 180.0;

/// [v]×, so that skew(v) * w = v × w.
inline Matrix3 skew(const Vector3& v) {
  Matrix3 m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// The same angle in (−π, π].
inline double wrap_angle(double angle_rad) {
  if (angle_rad > -kPi && angle_rad <= kPi) return angle_rad;
  const double wrapped = std::remainder(angle_rad, 2.0 * kPi);
  return wrapped <= -kPi ? wrapped + 2.0 * kPi : wrapped;
}

}  // namespace cdprcal
