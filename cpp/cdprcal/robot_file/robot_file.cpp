#include "cdprcal/robot_file/robot_file.hpp"

#include <filesystem>
#include <sstream>

#include "cdprcal/effects/schema.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/model/robot_check.hpp"
#include "cdprcal/robot_file/builtin_robots.hpp"
#include "cdprcal/robot_file/definition_reader.hpp"
#include "cdprcal/robot_file/effect_definitions.hpp"
#include "cdprcal/robot_file/yaml_reader.hpp"
#include "cdprcal/text.hpp"
#include "cdprcal/text_file.hpp"

namespace cdprcal {
namespace {

using detail::double_quoted;
using detail::YamlField;
using detail::YamlMapping;

/// Inertia of a platform that cannot turn, where its file gives none, by its mass: nothing that
/// can be seen depends on it; this is a ball of 0.1 m.
constexpr double kPointInertia_m2 = 0.4 * 0.1 * 0.1;

// Reading: one function a mapping of the file. A new section is one more key and one more function.

Platform read_platform(const YamlField& field) {
  const YamlMapping map(field, {"mass_kg", "centre_of_mass_m", "inertia_kg_m2", "motion",
                                "motion_plane_normal", "outline_m", "inertial_unit_m"});
  Platform platform;
  platform.mass_kg = map.require("mass_kg").number();
  if (const auto motion = map.find("motion")) {
    try {
      platform.motion = parse_motion(motion->text());
    } catch (const InputError& error) {
      motion->fail(error.what());
    }
  }
  if (const auto normal = map.find("motion_plane_normal")) {
    platform.motion_plane_normal = normal->direction();
  }
  if (const auto outline = map.find("outline_m")) {
    for (const YamlField& corner : outline->items()) platform.outline_m.push_back(corner.vector3());
  }
  if (const auto unit = map.find("inertial_unit_m")) platform.inertial_unit_m = unit->vector3();
  const bool is_point = row_of(platform.motion).is_point();
  if (!is_point || map.find("centre_of_mass_m")) {
    platform.centre_of_mass_m = map.require("centre_of_mass_m").vector3();
  }
  platform.inertia_kg_m2 = is_point && !map.find("inertia_kg_m2")
                               ? Matrix3(platform.mass_kg * kPointInertia_m2 * Matrix3::Identity())
                               : map.require("inertia_kg_m2").matrix3();
  return platform;
}

Pulley read_pulley(const YamlField& field) {
  const YamlMapping map(field,
                        {"radius_m", "position_m", "position_sigma_m", "x_axis", "swivel_axis"});
  Pulley pulley;
  pulley.radius_m = map.require("radius_m").number();
  pulley.position_m = map.require("position_m").vector3();
  if (const auto sigma = map.find("position_sigma_m")) {
    pulley.position_sigma_m = sigma->number_or_vector3();
  }
  if (pulley.radius_m == 0.0 && !map.find("x_axis") && !map.find("swivel_axis")) {
    pulley.axes_world.setZero();  // for complete_eyelets
    return pulley;
  }
  pulley.axes_world.col(0) = map.require("x_axis").direction();
  pulley.axes_world.col(2) = map.require("swivel_axis").direction();
  return pulley;  // the y axis is completed by finalise
}

Cable read_cable(const YamlField& field, Motion motion) {
  const YamlMapping map(field, {"pulley", "platform_anchor_m"});
  Cable cable{read_pulley(map.require("pulley")), Vector3::Zero()};
  if (!row_of(motion).is_point() || map.find("platform_anchor_m")) {
    cable.platform_anchor_m = map.require("platform_anchor_m").vector3();
  }
  return cable;
}

/// Eyelets whose file names no axes get some: they turn about the plane's normal or the vertical,
/// from the direction to the middle of all pulleys. Their length depends on neither.
void complete_eyelets(Robot& robot) {
  const Vector3 middle = middle_of_pulleys(robot);
  const bool planar = row_of(robot.platform.motion).is_planar();
  Vector3 axis = planar ? robot.platform.motion_plane_normal : Vector3(0.0, 0.0, -1.0);
  if (axis.isZero(0.0)) axis = -Vector3::UnitZ();  // finalise refuses the robot
  axis.normalize();
  for (Cable& cable : robot.cables) {
    if (!cable.pulley.axes_world.isZero(0.0)) continue;
    const Vector3 inwards = middle - cable.pulley.position_m;
    Vector3 x = inwards - inwards.dot(axis) * axis;
    if (!(x.norm() > 1e-9 * (1.0 + inwards.norm()))) x = axis.unitOrthogonal();
    cable.pulley.axes_world.col(0) = x.normalized();
    cable.pulley.axes_world.col(2) = axis;
  }
}

/// An angle that may be given in degrees or in radians, once.
double read_angle(const YamlMapping& map, const std::string& name, double fallback_rad) {
  const auto degrees = map.find(name + "_deg");
  const auto radians = map.find(name + "_rad");
  if (degrees && radians) radians->fail("is given in degrees too: delete one");
  if (degrees) return degrees->number() * kDegree;
  return radians ? radians->number() : fallback_rad;
}

/// The σ of all sensors in the order of the file: that of channels, attitude before tension.
template <class F>
void for_each_sigma(const F& f) {
  for (const ChannelRow& channel : kChannelTable) {
    if (channel.first == 0) f(channel.of());
  }
}

SensorSigma read_sigma(const YamlField& field) {
  std::vector<std::string> keys;
  for_each_sigma([&](const Sensor& sensor) {
    if (sensor.is_angle()) keys.push_back(std::string(sensor.sigma_name) + "_deg");
    keys.push_back(sensor.sigma_field());
  });
  keys.insert(keys.end(), {"wrench_force_N", "wrench_moment_Nm"});
  const YamlMapping map(field, keys);
  SensorSigma sigma;
  for_each_sigma([&](const Sensor& sensor) {
    double& value = sigma.*sensor.sigma;
    value = sensor.is_angle() ? read_angle(map, sensor.sigma_name, value)
                              : map.number_or(sensor.sigma_field(), value);
  });
  sigma.wrench_force_N = map.number_or("wrench_force_N", sigma.wrench_force_N);
  sigma.wrench_moment_Nm = map.number_or("wrench_moment_Nm", sigma.wrench_moment_Nm);
  return sigma;
}

Surroundings read_surroundings(const YamlMapping& map) {
  Surroundings out;
  out.floor_m = map.number_or("floor_m", out.floor_m);
  if (const auto boxes = map.find("keep_out")) {
    for (const YamlField& box : boxes->items()) {
      const YamlMapping corners(box, {"lower_m", "upper_m"});
      out.keep_out.push_back(
          {corners.require("lower_m").vector3(), corners.require("upper_m").vector3()});
    }
  }
  if (const auto limits = map.find("length_limits_m")) {
    const std::vector<double> length_m = limits->numbers(2);
    out.length_min_m = length_m[0];
    // to_yaml writes "no maximum" so: YAML's infinity is no number of a robot file.
    if (length_m[1] < std::numeric_limits<double>::max()) out.length_max_m = length_m[1];
  }
  return out;
}

void read_sensors(const YamlField& field, Robot& robot) {
  const YamlMapping map(field, {"euler_convention", "sigma"});
  if (const auto convention = map.find("euler_convention")) {
    try {
      robot.euler_convention = parse_euler_convention(convention->text());
    } catch (const InputError&) {
      convention->fail("must be one of XYZ, XZY, YXZ, YZX, ZXY, ZYX (intrinsic order), not " +
                       in_quotes(convention->text()));
    }
  }
  if (const auto sigma = map.find("sigma")) robot.sigma = read_sigma(*sigma);
}

AppliedEffect read_effect(const YamlField& field, const Robot& robot) {
  // Which keys are known follows from the name.
  const auto name = field.peek("name");
  const auto layout = name ? effect_layout(robot, name->text()) : std::nullopt;
  if (name && !layout) name->fail(unknown_effect(robot, name->text()));
  std::vector<std::string> keys{"name", "run"};
  if (layout) {
    for (const ParameterLayout& parameter : layout->parameters) keys.push_back(parameter.name);
  }
  const YamlMapping map(field, keys);
  AppliedEffect effect{map.require("name").text(), "", {}};
  if (const auto run = map.find("run")) effect.run = run->text();
  for (const ParameterLayout& parameter : layout->parameters) {
    if (parameter.optional && !map.find(parameter.name)) continue;
    effect.parameters.push_back(
        {parameter.name,
         map.require(parameter.name).numbers(extents(parameter.shape, robot.cable_count()))});
  }
  return effect;
}

// Writing.

std::string flow(const Vector3& v) {
  return "[" + shortest(v[0]) + ", " + shortest(v[1]) + ", " + shortest(v[2]) + "]";
}

/// Nested flow lists of the shape; `next` walks through the values.
std::string flow(const std::vector<int>& shape, std::size_t depth, const double*& next) {
  if (depth == shape.size()) return shortest(*next++);
  std::string list = "[";
  for (int i = 0; i < shape[depth]; ++i) list += (i > 0 ? ", " : "") + flow(shape, depth + 1, next);
  return list + "]";
}

/// Degrees when they read back as the very same radians (always so for an angle that was read in
/// degrees), radians otherwise.
std::string angle_entry(const std::string& name, double angle_rad) {
  const double nearest = angle_rad / kDegree;
  for (const double degrees :
       {nearest, std::nextafter(nearest, 0.0), std::nextafter(nearest, 1e9)}) {
    if (degrees * kDegree == angle_rad) return name + "_deg: " + shortest(degrees);
  }
  return name + "_rad: " + shortest(angle_rad);
}

std::string sigma_entry(const Robot& robot) {
  const SensorSigma& sigma = robot.sigma;
  const SensorSigma usual;
  std::string text = "{";
  for_each_sigma([&](const Sensor& sensor) {
    const double value = sigma.*sensor.sigma;
    // Of sensors that few robots have, only what somebody changed.
    if (sensor.is_absolute() && value == usual.*sensor.sigma) return;
    text += text.size() > 1 ? ", " : "";
    text += sensor.is_angle() ? angle_entry(sensor.sigma_name, value)
                              : sensor.sigma_field() + ": " + shortest(value);
  });
  // Derived values stay derived, so that a change of mass in the file changes them too.
  if (sigma.wrench_force_N != detail::default_wrench_force_N(robot)) {
    text += ", wrench_force_N: " + shortest(sigma.wrench_force_N);
  }
  if (sigma.wrench_moment_Nm != detail::default_wrench_moment_Nm(robot)) {
    text += ", wrench_moment_Nm: " + shortest(sigma.wrench_moment_Nm);
  }
  return text + "}";
}

std::string motion_entry(const Platform& platform) {
  if (platform.motion == Motion::r3t3) return "";
  std::string text = std::string("  motion: ") + to_string(platform.motion) + "\n";
  if (row_of(platform.motion).is_planar()) {
    text += "  motion_plane_normal: " + flow(platform.motion_plane_normal) + "\n";
  }
  return text;
}

std::string outline_entry(const Platform& platform) {
  std::string text;
  for (const Vector3& corner : platform.outline_m) add_item(text, flow(corner));
  return text.empty() ? "" : "  outline_m: [" + text + "]\n";
}

std::string inertial_unit_entry(const Platform& platform) {
  return platform.inertial_unit_m ? "  inertial_unit_m: " + flow(*platform.inertial_unit_m) + '\n'
                                  : "";
}

std::string surroundings_entry(const Surroundings& around) {
  std::string text;
  if (around.has_floor()) text += "floor_m: " + shortest(around.floor_m) + "\n";
  if (!around.keep_out.empty()) text += "keep_out:\n";
  for (const Box& box : around.keep_out) {
    text += "  - {lower_m: " + flow(box.lower_m) + ", upper_m: " + flow(box.upper_m) + "}\n";
  }
  if (around.limits_length()) {
    const double most_m = std::min(around.length_max_m, std::numeric_limits<double>::max());
    text += "length_limits_m: [" + shortest(around.length_min_m) + ", " + shortest(most_m) + "]\n";
  }
  return text;
}

std::string position_sigma_entry(const Pulley& pulley) {
  const Vector3& sigma = pulley.position_sigma_m;
  if (sigma.array().isNaN().all()) return "";
  const bool one = sigma[0] == sigma[1] && sigma[1] == sigma[2];
  return ", position_sigma_m: " + (one ? shortest(sigma[0]) : flow(sigma));
}

std::string effect_entry(const AppliedEffect& effect, const Robot& robot) {
  std::string text = "  - name: " + effect.name + "\n";
  if (!effect.run.empty()) text += "    run: " + double_quoted(effect.run) + "\n";
  const std::optional<EffectLayout> layout = effect_layout(robot, effect.name);
  for (const ParameterLayout& parameter : layout->parameters) {
    for (const AppliedEffect::Parameter& given : effect.parameters) {
      if (given.name != parameter.name) continue;
      const double* next = given.values.data();
      text += "    " + parameter.name + ": " +
              flow(extents(parameter.shape, robot.cable_count()), 0, next) + "\n";
    }
  }
  return text;
}

}  // namespace

Robot parse_robot(const std::string& yaml_text, const std::string& source) {
  const YamlField document = YamlField::parse_document(yaml_text, source);
  const YamlMapping map(
      document, {"name", "gravity_m_s2", "platform", "cables", "tension_limits_N", "floor_m",
                 "keep_out", "length_limits_m", "sensors", "effects", "effect_definitions"});
  Robot robot;
  robot.name = map.require("name").text();
  robot.gravity_m_s2 = map.number_or("gravity_m_s2", robot.gravity_m_s2);
  robot.platform = read_platform(map.require("platform"));
  for (const YamlField& cable : map.require("cables").items()) {
    robot.cables.push_back(read_cable(cable, robot.platform.motion));
  }
  complete_eyelets(robot);
  const std::vector<double> limits = map.require("tension_limits_N").numbers(2);
  robot.tension_min_N = limits[0];
  robot.tension_max_N = limits[1];
  robot.surroundings = read_surroundings(map);
  if (const auto sensors = map.find("sensors")) read_sensors(*sensors, robot);
  if (const auto definitions = map.find("effect_definitions")) {
    robot.own_effects = detail::read_definitions(*definitions);
  }
  if (const auto effects = map.find("effects")) {
    for (const YamlField& effect : effects->items()) {
      robot.effects.push_back(read_effect(effect, robot));
    }
  }
  try {
    detail::check_and_complete(robot);
    detail::check_effects(robot);
  } catch (const detail::FieldError& error) {
    document.fail_at(error.field, error.what());
  }
  return robot;
}

std::vector<std::string> builtin_robot_names() {
  std::vector<std::string> names;
  for (const auto& robot : detail::kBuiltinRobots) names.emplace_back(robot.name);
  return names;
}

std::string builtin_robot_yaml(const std::string& name) {
  for (const auto& robot : detail::kBuiltinRobots) {
    if (name == robot.name) return robot.yaml;
  }
  std::string known;
  for (const std::string& builtin : builtin_robot_names()) {
    add_item(known, builtin);
  }
  throw InputError("robot '" + name + "': neither a file nor a built-in robot (built in: " + known +
                   ")");
}

Robot load_robot(const std::string& name_or_path) {
  if (const std::size_t nul = name_or_path.find('\0'); nul != std::string::npos) {
    throw InputError(name_or_path.substr(0, nul) +
                     ": no file's name holds NUL bytes; check the path");
  }
  for (const auto& robot : detail::kBuiltinRobots) {
    if (name_or_path == robot.name) return parse_robot(robot.yaml, robot.name);
  }
  std::error_code error;
  if (!std::filesystem::exists(name_or_path, error)) {
    return parse_robot(builtin_robot_yaml(name_or_path), name_or_path);  // throws, naming both
  }
  return parse_robot(read_text_file(name_or_path, detail::kMostYamlBytes + 1), name_or_path);
}

std::string to_yaml(const Robot& robot) {
  Robot checked = robot;
  finalise(checked);
  check_effects(checked);
  std::ostringstream out;
  out << "name: " << double_quoted(checked.name) << '\n'
      << "gravity_m_s2: " << shortest(checked.gravity_m_s2) << '\n'
      << "platform:\n"
      << "  mass_kg: " << shortest(checked.platform.mass_kg) << '\n'
      << "  centre_of_mass_m: " << flow(checked.platform.centre_of_mass_m) << '\n'
      << "  inertia_kg_m2: [" << flow(checked.platform.inertia_kg_m2.row(0)) << ", "
      << flow(checked.platform.inertia_kg_m2.row(1)) << ", "
      << flow(checked.platform.inertia_kg_m2.row(2)) << "]\n"
      << motion_entry(checked.platform) << outline_entry(checked.platform)
      << inertial_unit_entry(checked.platform) << "cables:\n";
  for (const Cable& cable : checked.cables) {
    const Pulley& pulley = cable.pulley;
    out << "  - pulley: {radius_m: " << shortest(pulley.radius_m)
        << ", position_m: " << flow(pulley.position_m) << position_sigma_entry(pulley)
        << ", x_axis: " << flow(pulley.x_axis()) << ", swivel_axis: " << flow(pulley.swivel_axis())
        << "}\n"
        << "    platform_anchor_m: " << flow(cable.platform_anchor_m) << '\n';
  }
  out << "tension_limits_N: [" << shortest(checked.tension_min_N) << ", "
      << shortest(checked.tension_max_N) << "]\n"
      << surroundings_entry(checked.surroundings) << "sensors:\n"
      << "  euler_convention: " << to_string(checked.euler_convention) << '\n'
      << "  sigma: " << sigma_entry(checked) << '\n';
  out << effects_to_yaml(checked.own_effects);
  if (!checked.effects.empty()) out << "effects:\n";
  for (const AppliedEffect& effect : checked.effects) {
    out << effect_entry(effect, checked);
  }
  return out.str();
}

}  // namespace cdprcal
