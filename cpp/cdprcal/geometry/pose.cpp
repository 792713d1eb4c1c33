#include "cdprcal/geometry/pose.hpp"

#include "cdprcal/error.hpp"

namespace cdprcal {

Eigen::Quaterniond exp_so3(const Vector3& rotation_vector_rad) {
  const double angle_squared = rotation_vector_rad.squaredNorm();
  double w = 1.0, scale = 0.5;
  if (angle_squared < 1e-8) {  // Taylor: exact to double precision here
    w = 1.0 - angle_squared / 8.0;
    scale = 0.5 - angle_squared / 48.0;
  } else {
    const double angle = std::sqrt(angle_squared);
    w = std::cos(0.5 * angle);
    scale = std::sin(0.5 * angle) / angle;
  }
  const Vector3 v = scale * rotation_vector_rad;
  return {w, v.x(), v.y(), v.z()};
}

Vector3 log_so3(const Eigen::Quaterniond& rotation) {
  const double sign = rotation.w() < 0.0 ? -1.0 : 1.0;
  const Vector3 v = sign * rotation.vec();
  const double w = sign * rotation.w();
  const double norm = v.norm();
  if (norm < 1e-6) return (2.0 / w) * (1.0 - norm * norm / (3.0 * w * w)) * v;
  return (2.0 * std::atan2(norm, w) / norm) * v;
}

Matrix3 left_jacobian_so3(const Vector3& rotation_vector_rad) {
  const double angle_squared = rotation_vector_rad.squaredNorm();
  double a = 0.0, b = 0.0;  // (1 − cos θ)/θ², (θ − sin θ)/θ³
  if (angle_squared < 1e-6) {
    a = 0.5 - angle_squared / 24.0;
    b = 1.0 / 6.0 - angle_squared / 120.0;
  } else {
    const double angle = std::sqrt(angle_squared);
    a = (1.0 - std::cos(angle)) / angle_squared;
    b = (angle - std::sin(angle)) / (angle_squared * angle);
  }
  const Matrix3 axis = skew(rotation_vector_rad);
  return Matrix3::Identity() + a * axis + b * axis * axis;
}

Pose plus(const Pose& pose, const Vector6& twist) {
  return {pose.position_m + twist.head<3>(),
          (exp_so3(twist.tail<3>()) * pose.rotation).normalized()};
}

Vector6 minus(const Pose& to, const Pose& from) {
  Vector6 twist;
  twist << to.position_m - from.position_m, log_so3(to.rotation * from.rotation.conjugate());
  return twist;
}

double rotation_distance_rad(const Pose& a, const Pose& b) {
  return log_so3(a.rotation * b.rotation.conjugate()).norm();
}

double rotation_angle_difference_rad(const Pose& a, const Pose& b) {
  return std::abs(log_so3(a.rotation).norm() - log_so3(b.rotation).norm());
}

Eigen::Quaterniond rotation_from_matrix(const Matrix3& matrix) {
  if (!matrix.allFinite()) throw InputError("rotation: the 3x3 matrix must hold finite values");
  const double error = (matrix * matrix.transpose() - Matrix3::Identity()).cwiseAbs().maxCoeff();
  if (!(error < 1e-6) || matrix.determinant() < 0.0) {
    throw InputError(
        "rotation: the 3x3 matrix must be a rotation (here R Rᵀ differs from the identity "
        "or its determinant is negative)");
  }
  // Newton's iteration for the polar factor (Higham, SIAM J. Sci. Stat. Comput. 7, 1986): what is
  // off by 1e-6 is off by its square after one step.
  Matrix3 nearest = matrix;
  for (int step = 0; step < 2; ++step) {
    nearest = 0.5 * (nearest + Matrix3(nearest.inverse()).transpose()).eval();
  }
  return Eigen::Quaterniond(nearest).normalized();
}

Eigen::Quaterniond rotation_between(const Vector3& from, const Vector3& to) {
  const Vector3 a = from.normalized(), b = to.normalized();
  // 1 + a·b and a × b, by what neither loses where they nearly cancel.
  const Vector3 sum = a + b;
  if (sum.norm() < 1e-12) {  // half a turn, about whatever is across
    const Vector3 across = a.unitOrthogonal();
    return {0.0, across.x(), across.y(), across.z()};
  }
  const Vector3 v = a.cross(sum);
  return Eigen::Quaterniond(0.5 * sum.squaredNorm(), v.x(), v.y(), v.z()).normalized();
}

}  // namespace cdprcal
