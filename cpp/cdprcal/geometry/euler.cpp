#include "cdprcal/geometry/euler.hpp"

#include <array>

#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

struct Order {
  EulerConvention convention;
  const char* name;
  std::array<int, 3> axis;
};

constexpr std::array<Order, 6> kOrders{{{EulerConvention::XYZ, "XYZ", {0, 1, 2}},
                                        {EulerConvention::XZY, "XZY", {0, 2, 1}},
                                        {EulerConvention::YXZ, "YXZ", {1, 0, 2}},
                                        {EulerConvention::YZX, "YZX", {1, 2, 0}},
                                        {EulerConvention::ZXY, "ZXY", {2, 0, 1}},
                                        {EulerConvention::ZYX, "ZYX", {2, 1, 0}}}};

const Order& order_of(EulerConvention convention) {
  return kOrders[static_cast<std::size_t>(convention)];
}

Eigen::Quaterniond turn(int axis, double angle_rad) {
  return exp_so3(angle_rad * Vector3::Unit(axis));
}

}  // namespace

EulerConvention parse_euler_convention(const std::string& name) {
  for (const auto& order : kOrders) {
    if (name == order.name) return order.convention;
  }
  throw InputError("euler_convention: '" + name +
                   "' is not one of XYZ, XZY, YXZ, YZX, ZXY, ZYX (intrinsic order)");
}

std::string to_string(EulerConvention convention) { return order_of(convention).name; }

std::array<int, 3> euler_axes(EulerConvention convention) { return order_of(convention).axis; }

Eigen::Quaterniond rotation_from_euler(const Vector3& roll_pitch_yaw_rad,
                                       EulerConvention convention) {
  const auto& [a, b, c] = order_of(convention).axis;
  return turn(a, roll_pitch_yaw_rad[a]) * turn(b, roll_pitch_yaw_rad[b]) *
         turn(c, roll_pitch_yaw_rad[c]);
}

Vector3 euler_from_rotation(const Matrix3& rotation, EulerConvention convention) {
  const auto& [a, b, c] = order_of(convention).axis;
  // +1 for even orders (XYZ, YZX, ZXY), −1 for odd: the sign of every sine off the diagonal.
  const double sign = (b - a + 3) % 3 == 1 ? 1.0 : -1.0;
  Vector3 angles;
  const double cos_middle = std::hypot(rotation(a, a), rotation(a, b));
  angles[b] = std::atan2(sign * rotation(a, c), cos_middle);
  if (cos_middle > 1e-12) {
    angles[a] = std::atan2(-sign * rotation(b, c), rotation(c, c));
    // From R_aᵀ R rather than from −R(a,b)/R(a,a): near gimbal lock it makes up for the rounding
    // of the first angle, so that the three together give the rotation back to the last digits.
    const double cos_first = std::cos(angles[a]);
    const double sin_first = sign * std::sin(angles[a]);
    angles[c] = std::atan2(sign * (cos_first * rotation(b, a) + sin_first * rotation(c, a)),
                           cos_first * rotation(b, b) + sin_first * rotation(c, b));
  } else {
    angles[a] = std::atan2(sign * rotation(c, b), rotation(b, b));
    angles[c] = 0.0;
  }
  return angles;
}

Matrix3 euler_rate_matrix(const Vector3& roll_pitch_yaw_rad, EulerConvention convention) {
  const auto& [a, b, c] = order_of(convention).axis;
  const double sign = (b - a + 3) % 3 == 1 ? 1.0 : -1.0;  // e_a × e_b = sign · e_c
  const double cos_first = std::cos(roll_pitch_yaw_rad[a]);
  const double sin_first = sign * std::sin(roll_pitch_yaw_rad[a]);
  const double cos_middle = std::cos(roll_pitch_yaw_rad[b]);
  Matrix3 rates;
  rates(a, a) = 1.0;  // column a: the first axis itself
  rates(b, a) = rates(c, a) = 0.0;
  rates(a, b) = 0.0;  // column b: the second, after the first turn
  rates(b, b) = cos_first;
  rates(c, b) = sin_first;
  rates(a, c) = sign * std::sin(roll_pitch_yaw_rad[b]);  // column c: the third, after both
  rates(b, c) = -cos_middle * sin_first;
  rates(c, c) = cos_middle * cos_first;
  return rates;
}

EulerRateDerivative euler_rate_derivative(const Vector3& roll_pitch_yaw_rad,
                                          EulerConvention convention) {
  const auto& [a, b, c] = order_of(convention).axis;
  EulerRateDerivative result;
  result.rate_matrix = euler_rate_matrix(roll_pitch_yaw_rad, convention);
  const Matrix3 angles_by_rotation = result.rate_matrix.inverse();
  const Vector3 axis_a = result.rate_matrix.col(a);
  const Vector3 axis_b = result.rate_matrix.col(b);
  const Vector3 axis_c = result.rate_matrix.col(c);
  result.column_derivative[a].setZero();  // fixed in the world
  result.column_derivative[b] = axis_a.cross(axis_b) * angles_by_rotation.row(a);
  result.column_derivative[c] = -skew(axis_c);  // fixed in the platform: δ(R e) = δθ × R e
  return result;
}

}  // namespace cdprcal
