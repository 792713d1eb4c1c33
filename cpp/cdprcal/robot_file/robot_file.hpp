// The robot file (YAML 1.2) and the robots that are built in.
#pragma once

#include <string>
#include <vector>

#include "cdprcal/model/robot.hpp"

namespace cdprcal {

/// Parses a robot file's text; `source` is what messages call it. The result is finalised.
///
/// Required: name, platform {mass_kg, centre_of_mass_m, inertia_kg_m2}, cables (1 to 8, each
/// {pulley {radius_m, position_m, x_axis, swivel_axis}, platform_anchor_m}), tension_limits_N.
/// Optional: gravity_m_s2 (9.81), platform.motion (3R3T) and, of the planar ones,
/// motion_plane_normal; pulley.position_sigma_m (one number or three: how well its position is
/// known); platform.outline_m, corners of its body; floor_m, keep_out (a list of {lower_m,
/// upper_m}) and length_limits_m [minimum, maximum] (see Surroundings). A platform that cannot turn
/// (3T, 2T) needs no centre_of_mass_m, inertia_kg_m2 and platform_anchor_m (0), an eyelet (radius_m
/// 0) no x_axis and swivel_axis. sensors {euler_convention (XYZ), sigma {length_m (0.01),
/// swivel_deg (1), attitude_deg (2), tension_N (10), wrench_force_N and wrench_moment_Nm (see
/// SensorSigma)}}; swivel_rad and attitude_rad may stand for the angles in degrees; effects, a list
/// of known effects of the catalogue and faults of the readings, each {name, its parameters, and
/// run when it belongs to the one log of that file name} (effects/schema.hpp); effect_definitions,
/// effects beside the catalogue, written as text (effect_definitions.hpp).
///
/// Throws InputError "source:line:column: field: what is wrong and what to do" on unknown,
/// duplicate, missing or impossible fields, and on text that is no YAML, binary or over 250 kB.
Robot parse_robot(const std::string& yaml_text, const std::string& source);

/// A robot by built-in name ("irma4") or by path to a robot file. A built-in name wins over a file
/// of the same name (write ./irma4 for the file).
Robot load_robot(const std::string& name_or_path);

/// The robot, finalised, as a robot file that parse_robot reads back to the last bit.
/// Throws InputError when finalise does.
std::string to_yaml(const Robot& robot);

/// Names that load_robot knows without a file, and the file text of one.
std::vector<std::string> builtin_robot_names();
std::string builtin_robot_yaml(const std::string& name);

}  // namespace cdprcal
