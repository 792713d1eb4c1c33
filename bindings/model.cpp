// model/ and robot_file/: the robot as data, and its file (parsed once, in C++).
#include "cdprcal/effects/schema.hpp"
#include "cdprcal/model/robot.hpp"

#include <array>
#include <map>

#include <pybind11/stl/filesystem.h>

#include <filesystem>

#include "bindings.hpp"
#include "cdprcal/robot_file/effect_definitions.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "sensors.hpp"

namespace cdprcal::python {
namespace {

/// The library's own check of a pulley, by way of a robot that has nothing else wrong.
Pulley make_pulley(const Vector3& position_m, const Vector3& x_axis, const Vector3& swivel_axis,
                   double radius_m, const std::optional<Vector3>& position_sigma_m) {
  Robot probe;
  probe.name = "pulley";
  probe.tension_max_N = 1.0;
  Cable cable;
  cable.pulley.radius_m = radius_m;
  cable.pulley.position_m = position_m;
  if (position_sigma_m) cable.pulley.position_sigma_m = *position_sigma_m;
  cable.pulley.axes_world << x_axis, swivel_axis.cross(x_axis), swivel_axis;
  probe.cables = {cable};
  try {
    finalise(probe);
  } catch (const InputError& error) {
    const std::string message = error.what();
    const auto field = message.find("pulley.");
    throw InputError(field == std::string::npos ? message : message.substr(field));
  }
  return probe.cables[0].pulley;
}

void register_model_parts(py::module_& module) {
  py::class_<Pulley>(module, "Pulley",
                     "Swivel pulley: the groove is tangent to the swivel axis at D (Fig. 1). "
                     "Immutable.")
      .def(py::init(&make_pulley), py::kw_only(), py::arg("position_m"), py::arg("x_axis"),
           py::arg("swivel_axis"), py::arg("radius_m") = 0.0,
           py::arg("position_sigma_m") = py::none(),
           "position_m [3]: D in the world. x_axis [3]: direction of zero swivel angle; "
           "swivel_axis [3]: perpendicular to it; both in world axes, any length. radius_m: 0 is a "
           "plain eyelet. position_sigma_m [3]: how well position_m is known; None: as well as "
           "usual. Raises InputError naming the field.")
      .def_readonly("radius_m", &Pulley::radius_m)
      .def_property_readonly(
          "position_m", [](const Pulley& p) { return p.position_m; },
          "D in the world [3] [m]; a copy.")
      .def_property_readonly(
          "position_sigma_m", [](const Pulley& p) { return p.position_sigma_m; },
          "How well position_m is known, along each world axis [3] [m]; NaN: as well as usual.")
      .def_property_readonly(
          "axes_world", [](const Pulley& p) { return p.axes_world; },
          "Columns i (x_axis), j, k (swivel_axis) [3, 3]; j = k × i; a copy.")
      .def_property_readonly("x_axis", &Pulley::x_axis, "i [3].")
      .def_property_readonly("y_axis", &Pulley::y_axis, "j = k × i [3].")
      .def_property_readonly("swivel_axis", &Pulley::swivel_axis, "k [3].");
  py::class_<Cable>(module, "Cable", "A pulley and where the cable holds the platform. Immutable.")
      .def(py::init([](const Pulley& pulley, const Vector3& anchor) {
             require_finite(anchor, "platform_anchor_m");
             return Cable{pulley, anchor};
           }),
           py::kw_only(), py::arg("pulley"), py::arg("platform_anchor_m"),
           "platform_anchor_m [3]: a′ in the platform frame.")
      .def_property_readonly("pulley", [](const Cable& c) { return c.pulley; })
      .def_property_readonly(
          "platform_anchor_m", [](const Cable& c) { return c.platform_anchor_m; },
          "a′ in the platform frame [3] [m]; a copy.");
  py::class_<Box>(module, "Box", "Axis-aligned box [m], world axes. Immutable.")
      .def(py::init([](const Vector3& lower_m, const Vector3& upper_m) {
             require_finite(lower_m, "lower_m");
             require_finite(upper_m, "upper_m");
             if ((lower_m.array() > upper_m.array()).any()) {
               throw InputError("Box: lower_m " + to_text(lower_m) + " is above upper_m " +
                                to_text(upper_m) + "; give the lower corner first");
             }
             return Box{lower_m, upper_m};
           }),
           py::arg("lower_m"), py::arg("upper_m"), "Corners [3] [m].")
      .def_property_readonly(
          "lower_m", [](const Box& b) { return b.lower_m; }, "[3]; a copy.")
      .def_property_readonly(
          "upper_m", [](const Box& b) { return b.upper_m; }, "[3]; a copy.")
      .def_property_readonly("volume_m3", &Box::volume_m3)
      .def("contains", &Box::contains, py::arg("position_m"), py::arg("tolerance_m") = 0.0)
      .def("__repr__", [](const Box& b) {
        return "Box(" + to_text(b.lower_m) + ", " + to_text(b.upper_m) + ")";
      });
  py::class_<Platform>(module, "Platform", "Mass, its centre and inertia. Immutable.")
      .def(
          py::init([](double mass_kg, const Vector3& centre, const Matrix3& inertia,
                      const std::string& motion, const std::optional<Vector3>& normal,
                      const std::vector<Vector3>& outline_m,
                      const std::optional<Vector3>& inertial_unit_m) {
            try {
              return Platform{mass_kg,
                              centre,
                              inertia,
                              parse_motion(motion),
                              normal.value_or(Vector3::Zero()),
                              outline_m,
                              inertial_unit_m};
            } catch (const InputError& error) {
              throw InputError(std::string("motion: ") + error.what());
            }
          }),
          py::kw_only(), py::arg("mass_kg"), py::arg("centre_of_mass_m"), py::arg("inertia_kg_m2"),
          py::arg("motion") = "3R3T", py::arg("motion_plane_normal") = py::none(),
          py::arg_v("outline_m", std::vector<Vector3>{}, "[]"),
          py::arg("inertial_unit_m") = py::none(),
          "centre_of_mass_m [3]: s′ in the platform frame; inertia_kg_m2 [3, 3]: about the centre "
          "of mass, platform axes. motion: 3R3T, 3T, 1R2T or 2T (turns R, shifts T); "
          "motion_plane_normal [3]: across the plane of the last two, in the world. outline_m: list "
          "of [3], corners of its body in the platform frame. inertial_unit_m [3]: where its "
          "inertial unit sits, in the platform frame. Checked when a Robot is made of it.")
      .def_readonly("mass_kg", &Platform::mass_kg)
      .def_property_readonly(
          "centre_of_mass_m", [](const Platform& p) { return p.centre_of_mass_m; },
          "s′ in the platform frame [3] [m]; a copy.")
      .def_property_readonly(
          "inertia_kg_m2", [](const Platform& p) { return p.inertia_kg_m2; },
          "About the centre of mass, platform axes [3, 3]; a copy.")
      .def_property_readonly(
          "motion", [](const Platform& p) { return to_string(p.motion); },
          "What the platform can do: 3R3T, 3T, 1R2T or 2T (turns R, shifts T).")
      .def_property_readonly(
          "motion_plane_normal",
          [](const Platform& p) -> std::optional<Vector3> {
            if (!row_of(p.motion).is_planar()) return std::nullopt;
            return p.motion_plane_normal;
          },
          "Across the plane of a planar motion, in the world [3]; None for the others.")
      .def_property_readonly(
          "outline_m", [](const Platform& p) { return p.outline_m; },
          "Corners of its body in the platform frame, list of [3] [m]; a copy.")
      .def_property_readonly(
          "inertial_unit_m", [](const Platform& p) { return p.inertial_unit_m; },
          "Where its inertial unit sits, in the platform frame [3] [m]; None: not known, or none.");
  py::class_<Surroundings>(module, "Surroundings",
                           "What a platform must keep from, besides what its cables can carry. "
                           "Immutable.")
      .def(py::init([](double floor_m, const std::vector<Box>& keep_out,
                       const std::array<double, 2>& length_limits_m) {
             return Surroundings{floor_m, keep_out, length_limits_m[0], length_limits_m[1]};
           }),
           py::kw_only(), py::arg("floor_m") = Surroundings{}.floor_m,
           py::arg_v("keep_out", std::vector<Box>{}, "[]"),
           py::arg("length_limits_m") =
               std::array<double, 2>{Surroundings{}.length_min_m, Surroundings{}.length_max_m},
           "floor_m: z that no part of the platform goes below; keep_out: list of Box that neither "
           "platform nor cables enter; length_limits_m: (minimum, maximum) of every cable. Checked "
           "when a Robot is made of it.")
      .def_readonly("floor_m", &Surroundings::floor_m)
      .def_property_readonly(
          "keep_out", [](const Surroundings& s) { return s.keep_out; }, "List of Box; a copy.")
      .def_property_readonly(
          "length_limits_m",
          [](const Surroundings& s) {
            return std::array<double, 2>{s.length_min_m, s.length_max_m};
          },
          "[minimum, maximum] [m].");
  const SensorSigma usual;
  py::class_<SensorSigma> cls(module, "SensorSigma",
                              "One-sigma errors of the readings (eq. 18 by default) and of the "
                              "statics model. Immutable.");
  def_absolute<SensorSigma>(cls);
  cls.def(py::init([](double length_m, double swivel_rad, double attitude_rad, double tension_N,
                      double wrench_force_N, double wrench_moment_Nm, const py::kwargs& absolute) {
            SensorSigma sigma;
            sigma.length_m = length_m;
            sigma.swivel_rad = swivel_rad;
            sigma.attitude_rad = attitude_rad;
            sigma.tension_N = tension_N;
            sigma.wrench_force_N = wrench_force_N;
            sigma.wrench_moment_Nm = wrench_moment_Nm;
            set_absolute(absolute, sigma);
            return sigma;
          }),
          py::kw_only(), py::arg("length_m") = usual.length_m,
          py::arg("swivel_rad") = usual.swivel_rad, py::arg("attitude_rad") = usual.attitude_rad,
          py::arg("tension_N") = usual.tension_N, py::arg("wrench_force_N") = usual.wrench_force_N,
          py::arg("wrench_moment_Nm") = usual.wrench_moment_Nm,
          "wrench_force_N, wrench_moment_Nm: what the wrench balance may be wrong by beyond the "
          "load cells; 0 means what a geometry known to 1 mm leaves. More keywords: those of "
          "absolute sensors, by the names of the attributes. Checked when used.")
      .def_readonly("length_m", &SensorSigma::length_m)
      .def_readonly("swivel_rad", &SensorSigma::swivel_rad)
      .def_readonly("attitude_rad", &SensorSigma::attitude_rad)
      .def_readonly("tension_N", &SensorSigma::tension_N)
      .def_readonly("wrench_force_N", &SensorSigma::wrench_force_N)
      .def_readonly("wrench_moment_Nm", &SensorSigma::wrench_moment_Nm);
}

AppliedEffect make_effect(const std::string& name,
                          const std::map<std::string, std::vector<double>>& parameters,
                          const std::string& run) {
  AppliedEffect effect{name, run, {}};
  for (const auto& [key, values] : parameters) effect.parameters.push_back({key, values});
  return effect;
}

void register_effect(py::module_& module) {
  py::class_<AppliedEffect>(module, "AppliedEffect",
                            "A known effect, or a known fault of the readings, as the robot file "
                            "lists it. Immutable.")
      .def(py::init(&make_effect), py::kw_only(), py::arg("name"), py::arg("parameters"),
           py::arg("run") = "",
           "parameters: name → numbers, nested lists one after the other. run: file name of the "
           "one log it belongs to; empty: every log. Checked when a Robot is made of it.")
      .def_readonly("name", &AppliedEffect::name)
      .def_readonly("run", &AppliedEffect::run)
      .def_property_readonly(
          "parameters",
          [](const AppliedEffect& effect) {
            std::map<std::string, std::vector<double>> parameters;
            for (const auto& parameter : effect.parameters) {
              parameters[parameter.name] = parameter.values;
            }
            return parameters;
          },
          "Name → numbers, in the robot file's units; a copy.");
}

Robot make_robot(const std::string& name, const Platform& platform, std::vector<Cable> cables,
                 const std::array<double, 2>& tension_limits_N, double gravity_m_s2,
                 EulerConvention euler_convention, const std::optional<SensorSigma>& sigma,
                 std::vector<AppliedEffect> effects, const Surroundings& surroundings,
                 const std::string& effect_definitions) {
  Robot robot;
  robot.name = name;
  robot.gravity_m_s2 = gravity_m_s2;
  robot.platform = platform;
  robot.cables = std::move(cables);
  robot.tension_min_N = tension_limits_N[0];
  robot.tension_max_N = tension_limits_N[1];
  robot.euler_convention = euler_convention;
  if (sigma) robot.sigma = *sigma;
  robot.effects = std::move(effects);
  robot.surroundings = surroundings;
  if (!effect_definitions.empty()) {
    robot.own_effects = parse_effects(effect_definitions, "effect_definitions");
  }
  finalise(robot);
  check_effects(robot);
  return robot;
}

}  // namespace

void register_model(py::module_& module) {
  register_model_parts(module);
  register_effect(module);
  py::class_<Robot>(module, "Robot",
                    "Platform, cables on swivel pulleys, limits and sensors. Immutable; pickles as "
                    "its robot file.")
      .def(
          py::init(&make_robot), py::kw_only(), py::arg("name"), py::arg("platform"),
          py::arg("cables"), py::arg("tension_limits_N"), py::arg("gravity_m_s2") = 9.81,
          py::arg_v("euler_convention", EulerConvention::XYZ, "EulerConvention.XYZ"),
          py::arg("sigma") = py::none(), py::arg_v("effects", std::vector<AppliedEffect>{}, "[]"),
          py::arg_v("surroundings", Surroundings{}, "Surroundings()"),
          py::arg("effect_definitions") = "",
          "cables: 1 to 8 Cable; tension_limits_N: (minimum, maximum); sigma: None is eq. 18; "
          "effects: known effects and faults of the readings, as the robot file lists them; "
          "surroundings: floor, keep-out boxes, limits of length; effect_definitions: effects beside "
          "the catalogue, as text (YAML with the key effect_definitions). Checks every field and fills defaults; raises InputError naming the field.")
      .def_readonly("name", &Robot::name)
      .def_readonly("gravity_m_s2", &Robot::gravity_m_s2)
      .def_property_readonly("platform", [](const Robot& robot) { return robot.platform; })
      .def_property_readonly(
          "cables", [](const Robot& robot) { return robot.cables; }, "List of n Cable; a copy.")
      .def_property_readonly(
          "tension_limits_N",
          [](const Robot& robot) {
            return std::array<double, 2>{robot.tension_min_N, robot.tension_max_N};
          },
          "[minimum, maximum] [N].")
      .def_readonly("tension_min_N", &Robot::tension_min_N)
      .def_readonly("tension_max_N", &Robot::tension_max_N)
      .def_readonly("euler_convention", &Robot::euler_convention)
      .def_property_readonly("sigma", [](const Robot& robot) { return robot.sigma; })
      .def_property_readonly("surroundings", [](const Robot& robot) { return robot.surroundings; })
      .def_property_readonly(
          "effects", [](const Robot& robot) { return robot.effects; },
          "List of AppliedEffect; a copy.")
      .def_property_readonly(
          "effect_definitions",
          [](const Robot& robot) { return effects_to_yaml(robot.own_effects); },
          "Its effects beside the catalogue as text (YAML); empty: none.")
      .def_property_readonly("cable_count", &Robot::cable_count)
      .def_property_readonly("weight_N", &Robot::weight_N)
      .def_property_readonly("gravity_force_N", &Robot::gravity_force_N,
                             "Weight as a force in world axes [3] [N]; z points up.")
      .def("__repr__",
           [](const Robot& robot) {
             return "Robot(name='" + robot.name +
                    "', cable_count=" + std::to_string(robot.cable_count()) + ")";
           })
      .def(py::pickle([](const Robot& robot) { return py::make_tuple(to_yaml(robot)); },
                      [](const py::tuple& state) {
                        return parse_robot(state[0].cast<std::string>(), "pickled robot");
                      }));
  module.def("parse_robot", &parse_robot, py::arg("yaml_text"), py::arg("source"),
             "Parses a robot file's text; `source` is what messages call it. Raises InputError "
             "'source:line:column: field: …'.");
  module.def(
      "load_robot",
      [](const std::filesystem::path& name_or_path) { return load_robot(name_or_path); },
      py::arg("name_or_path"),
      "A robot by built-in name ('irma4') or by path to a robot file. Raises InputError.");
  module.def("to_yaml", &to_yaml, py::arg("robot"),
             "The robot as a robot file that parse_robot reads back exactly.");
  module.def("builtin_robot_names", &builtin_robot_names,
             "Names that load_robot knows without a file.");
  module.def("builtin_robot_yaml", &builtin_robot_yaml, py::arg("name"),
             "Robot file text of a built-in robot. Raises InputError for an unknown name.");
}

}  // namespace cdprcal::python
