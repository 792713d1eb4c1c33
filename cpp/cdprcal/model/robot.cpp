#include "cdprcal/model/robot.hpp"

#include <Eigen/Geometry>
#include <array>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/model/robot_check.hpp"
#include "cdprcal/model/yardstick.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace detail {
namespace {

/// How far from perpendicular x_axis and swivel_axis may be written (cosine of their angle): a
/// rounded file is put right, a wrong one is refused.
constexpr double kPerpendicularTolerance = 1e-3;
/// How well the geometry of irma4 is known, which was measured with a tape [m] (paper §4).
constexpr double kGeometryError_m = 1e-3;
/// A vector this close to exact is left alone, so that finalising twice changes no bit.
constexpr double kRounding = 8.0 * std::numeric_limits<double>::epsilon();
constexpr double kInertiaTolerance = 1e-9;

void require_finite(double value, const std::string& field) {
  if (!std::isfinite(value)) {
    throw FieldError(field, "must be a finite number, not " + shortest(value));
  }
}

void require_positive(double value, const std::string& field) {
  require_finite(value, field);
  if (!(value > 0.0)) throw FieldError(field, "must be positive, not " + shortest(value));
}

void require_not_negative(double value, const std::string& field) {
  require_finite(value, field);
  if (value < 0.0) throw FieldError(field, "must not be negative, but is " + shortest(value));
}

void require_finite(const Vector3& value, const std::string& field) {
  if (!value.allFinite()) throw FieldError(field, "must be three finite numbers");
}

Vector3 unit_vector(const Vector3& value, const std::string& field) {
  require_finite(value, field);
  const double norm = value.stableNorm();
  if (!(norm > 0.0)) {
    throw FieldError(field, "is zero: give a direction in the world, such as [0, 0, -1]");
  }
  if (std::abs(norm - 1.0) <= kRounding) return value;
  return value.stableNormalized();
}

void complete_axes(Pulley& pulley, std::size_t index) {
  Vector3 x = unit_vector(pulley.x_axis(), cable_field(index, "pulley.x_axis"));
  const Vector3 k = unit_vector(pulley.swivel_axis(), cable_field(index, "pulley.swivel_axis"));
  const double cosine = x.dot(k);
  if (std::abs(cosine) > kPerpendicularTolerance) {
    throw FieldError(cable_field(index, "pulley.x_axis"),
                     "must be perpendicular to swivel_axis, but the cosine of their angle is " +
                         shortest(cosine) + "; x_axis is the direction of zero swivel angle");
  }
  for (int pass = 0; pass < 3 && std::abs(x.dot(k)) > kRounding; ++pass) {
    x = (x - x.dot(k) * k).normalized();
  }
  pulley.axes_world << x, k.cross(x), k;  // y = swivel × x
}

void check_inertia(Matrix3& inertia) {
  const std::string field = "platform.inertia_kg_m2";
  if (!inertia.allFinite()) throw FieldError(field, "must be nine finite numbers");
  const double scale = inertia.cwiseAbs().maxCoeff();
  if (!((inertia - inertia.transpose()).cwiseAbs().maxCoeff() <= kInertiaTolerance * scale)) {
    throw FieldError(field, "must be symmetric: rows and columns differ");
  }
  inertia = (0.5 * (inertia + inertia.transpose())).eval();
  const Vector3 moments = symmetric_eigenvalues(inertia);
  if (!(moments[0] > kInertiaTolerance * scale)) {
    throw FieldError(field, "must be positive definite, but its least principal moment is " +
                                shortest(moments[0]));
  }
  // Any body obeys J1 + J2 ≥ J3: a sign slip or a tensor about another point often does not.
  if (moments[0] + moments[1] < moments[2] * (1.0 - kInertiaTolerance)) {
    throw FieldError(field, "no body has the principal moments " + shortest(moments[0]) + ", " +
                                shortest(moments[1]) + ", " + shortest(moments[2]) +
                                ": the two smaller must add up to the largest or more; give the "
                                "tensor about the centre of mass");
  }
}

void check_motion(Platform& platform) {
  const std::string field = "platform.motion_plane_normal";
  Vector3& normal = platform.motion_plane_normal;
  if (!row_of(platform.motion).is_planar()) {
    if (normal.isZero(0.0)) return;
    throw FieldError(field, std::string("is for the planar motions 1R2T and 2T, and this is ") +
                                to_string(platform.motion) + ": delete it, or change the motion");
  }
  if (normal.isZero(0.0)) {
    throw FieldError(field, std::string("is missing or zero: the motion ") +
                                to_string(platform.motion) +
                                " needs the direction across its plane, such as [0, 1, 0]");
  }
  normal = unit_vector(normal, field);
}

void check_position_sigma(const Pulley& pulley, std::size_t index) {
  if (pulley.position_sigma_m.array().isNaN().all()) return;
  for (const double sigma : pulley.position_sigma_m) {
    require_positive(sigma, cable_field(index, "pulley.position_sigma_m"));
  }
}

void require_limits(double least, double most, const std::string& field) {
  if (least >= 0.0 && least < most) return;
  throw FieldError(field, "must be [minimum, maximum] with 0 ≤ minimum < maximum, not [" +
                              shortest(least) + ", " + shortest(most) + "]");
}

void check_surroundings(const Surroundings& around) {
  const double endless = std::numeric_limits<double>::infinity();
  if (around.floor_m != -endless) require_finite(around.floor_m, "floor_m");
  for (std::size_t i = 0; i < around.keep_out.size(); ++i) {
    const Box& box = around.keep_out[i];
    const std::string field = "keep_out[#" + std::to_string(i + 1) + "]";
    require_finite(box.lower_m, field + ".lower_m");
    require_finite(box.upper_m, field + ".upper_m");
    if (!(box.lower_m.array() < box.upper_m.array()).all()) {
      throw FieldError(field + ".lower_m", "must be below upper_m in every direction");
    }
  }
  require_finite(around.length_min_m, "length_limits_m");
  require_limits(around.length_min_m, around.length_max_m, "length_limits_m");
}

void check_sigma(const Robot& robot) {
  const SensorSigma& sigma = robot.sigma;
  for (const Sensor& sensor : kSensorTable) {
    if (!sensor.sigma) continue;
    const std::string unit = sensor.is_angle() ? "deg" : sensor.unit;
    require_positive(sigma.*sensor.sigma,
                     "sensors.sigma." + std::string(sensor.sigma_name) + "_" + unit);
  }
  require_not_negative(sigma.wrench_force_N, "sensors.sigma.wrench_force_N");
  require_not_negative(sigma.wrench_moment_Nm, "sensors.sigma.wrench_moment_Nm");
}

}  // namespace

std::string cable_field(std::size_t index, const std::string& name) {
  return "cables[#" + std::to_string(index + 1) + "]." + name;
}

double default_wrench_force_N(const Robot& robot) {
  return robot.weight_N() * kGeometryError_m;  // a cable direction wrong by 1 mm in about 1 m
}

double default_wrench_moment_Nm(const Robot& robot) {
  // the weight at a lever wrong by 1 mm, or more in a larger frame
  return robot.weight_N() * kGeometryError_m * times_reference(Yardstick::frame, robot);
}

void check_and_complete(Robot& robot) {
  if (robot.name.empty()) throw FieldError("name", "must not be empty");
  for (const char c : robot.name) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      throw FieldError("name", "must not hold control characters");
    }
  }
  require_positive(robot.gravity_m_s2, "gravity_m_s2");
  require_positive(robot.platform.mass_kg, "platform.mass_kg");
  require_finite(robot.platform.centre_of_mass_m, "platform.centre_of_mass_m");
  check_inertia(robot.platform.inertia_kg_m2);
  check_motion(robot.platform);
  for (const Vector3& corner : robot.platform.outline_m) {
    require_finite(corner, "platform.outline_m");
  }
  if (robot.platform.inertial_unit_m) {
    require_finite(*robot.platform.inertial_unit_m, "platform.inertial_unit_m");
  }

  if (robot.cables.empty() || robot.cables.size() > static_cast<std::size_t>(kMaxCables)) {
    throw FieldError("cables", "a robot must have 1 to " + std::to_string(kMaxCables) +
                                   " cables, not " + std::to_string(robot.cables.size()));
  }
  for (std::size_t i = 0; i < robot.cables.size(); ++i) {
    Cable& cable = robot.cables[i];
    require_not_negative(cable.pulley.radius_m, cable_field(i, "pulley.radius_m"));
    require_finite(cable.pulley.position_m, cable_field(i, "pulley.position_m"));
    check_position_sigma(cable.pulley, i);
    complete_axes(cable.pulley, i);
    require_finite(cable.platform_anchor_m, cable_field(i, "platform_anchor_m"));
  }

  require_finite(robot.tension_min_N, "tension_limits_N");
  require_finite(robot.tension_max_N, "tension_limits_N");
  require_limits(robot.tension_min_N, robot.tension_max_N, "tension_limits_N");
  check_surroundings(robot.surroundings);
  check_sigma(robot);
  if (robot.sigma.wrench_force_N == 0.0) {
    robot.sigma.wrench_force_N = default_wrench_force_N(robot);
  }
  if (robot.sigma.wrench_moment_Nm == 0.0) {
    robot.sigma.wrench_moment_Nm = default_wrench_moment_Nm(robot);
  }
}

}  // namespace detail

const char* to_string(Motion motion) { return row_of(motion).name; }

Motion parse_motion(const std::string& name) {
  for (std::size_t i = 0; i < kMotionTable.size(); ++i) {
    if (name == kMotionTable[i].name) return static_cast<Motion>(i);
  }
  std::string known;
  for (const MotionRow& row : kMotionTable) add_item(known, row.name);
  throw InputError("must be one of " + known + " (turns R, shifts T), not " + in_quotes(name));
}

double robot_size_m(const Robot& robot) {
  double pulleys = 0.0;
  double anchors = 0.0;
  for (const Cable& a : robot.cables) {
    for (const Cable& b : robot.cables) {
      pulleys = std::max(pulleys, (a.pulley.position_m - b.pulley.position_m).norm());
      anchors = std::max(anchors, (a.platform_anchor_m - b.platform_anchor_m).norm());
    }
  }
  if (pulleys > 0.0) return pulleys;
  return anchors > 0.0 ? anchors : 1.0;
}

Box pulley_box(const Robot& robot) {
  Box out = Box::empty();
  for (const Cable& cable : robot.cables) out.include(cable.pulley.position_m);
  return out;
}

Vector3 middle_of_pulleys(const Robot& robot) {
  Vector3 sum = Vector3::Zero();
  for (const Cable& cable : robot.cables) sum += cable.pulley.position_m;
  return sum / std::max(1, robot.cable_count());
}

double platform_reach_m(const Robot& robot) {
  double reach = robot.platform.centre_of_mass_m.norm();
  for (const Cable& cable : robot.cables) reach = std::max(reach, cable.platform_anchor_m.norm());
  return reach;
}

double characteristic_length_m(const Robot& robot) {
  double sum = 0.0;
  for (const Cable& cable : robot.cables) {
    sum += (cable.platform_anchor_m - robot.platform.centre_of_mass_m).squaredNorm();
  }
  const double length = std::sqrt(sum / std::max(1, robot.cable_count()));
  return length > 1e-9 ? length : 1.0;
}

void finalise(Robot& robot) {
  detail::as_input_error([&] { detail::check_and_complete(robot); });
}

}  // namespace cdprcal
