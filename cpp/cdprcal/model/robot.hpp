// A robot as data: platform, cables on swivel pulleys, limits and sensors.
#pragma once

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cdprcal/geometry/box.hpp"
#include "cdprcal/geometry/euler.hpp"
#include "cdprcal/model/sensors.hpp"
#include "cdprcal/types.hpp"

namespace cdprcal {

/// Swivel pulley: the groove is tangent to the swivel axis at D (paper Fig. 1).
struct Pulley {
  double radius_m = 0.0;                     ///< r; 0 is a plain eyelet
  Vector3 position_m = Vector3::Zero();      ///< d: point D in the world
  Matrix3 axes_world = Matrix3::Identity();  ///< columns i (x_axis), j, k (swivel_axis); j = k × i
  /// How well d is known, one sigma along each world axis; NaN: as well as usual (some mm).
  Vector3 position_sigma_m = Vector3::Constant(kNaN);

  [[nodiscard]] Vector3 x_axis() const { return axes_world.col(0); }
  [[nodiscard]] Vector3 y_axis() const { return axes_world.col(1); }
  [[nodiscard]] Vector3 swivel_axis() const { return axes_world.col(2); }
};

struct Cable {
  Pulley pulley;
  Vector3 platform_anchor_m = Vector3::Zero();  ///< a′ in the platform frame
};

/// What the platform can do, in turns (R) and shifts (T).
enum class Motion {
  r3t3,  ///< anything
  t3,    ///< shifts in space: R = I, as of a point
  r1t2,  ///< turns about the plane's normal and shifts in the plane
  t2     ///< shifts in a plane: R = I
};

/// One row for each Motion, in its order.
struct MotionRow {
  const char* name;  ///< in robot files: "3R3T"
  int turns, shifts;

  [[nodiscard]] constexpr bool is_planar() const { return shifts == 2; }
  [[nodiscard]] constexpr bool is_point() const { return turns == 0; }
};
inline constexpr std::array<MotionRow, 4> kMotionTable{
    {{"3R3T", 3, 3}, {"3T", 0, 3}, {"1R2T", 1, 2}, {"2T", 0, 2}}};
inline const MotionRow& row_of(Motion motion) {
  return kMotionTable[static_cast<std::size_t>(motion)];
}
/// "3R3T", "3T", "1R2T" or "2T".
const char* to_string(Motion motion);
/// The Motion of such a name; throws InputError that lists the names.
Motion parse_motion(const std::string& name);

struct Platform {
  double mass_kg = 1.0;
  Vector3 centre_of_mass_m = Vector3::Zero();   ///< s′ in the platform frame
  Matrix3 inertia_kg_m2 = Matrix3::Identity();  ///< about the centre of mass, platform axes
  Motion motion = Motion::r3t3;
  /// n of planar motions, a unit vector in the world; zero otherwise. P stays in the plane through
  /// the world's origin (n·p = 0), and what turns, turns about n.
  Vector3 motion_plane_normal = Vector3::Zero();
  /// Corners of its body in the platform frame, where it reaches further than P and the anchors.
  std::vector<Vector3> outline_m;
  /// Where its inertial unit sits, in the platform frame; nothing: not known, or none.
  std::optional<Vector3> inertial_unit_m;
};

/// What a platform that the cables could carry must keep from (kinematics/obstruction.hpp).
struct Surroundings {
  double floor_m = -std::numeric_limits<double>::infinity();  ///< no part is below this z
  std::vector<Box> keep_out;  ///< neither platform nor cables enter these
  double length_min_m = 0.0;  ///< of every cable's length l (eq. 5)
  double length_max_m = std::numeric_limits<double>::infinity();

  [[nodiscard]] bool limits_length() const {
    return length_min_m > 0.0 || length_max_m < std::numeric_limits<double>::infinity();
  }
  [[nodiscard]] bool has_floor() const { return std::isfinite(floor_m); }
  [[nodiscard]] bool any() const { return has_floor() || !keep_out.empty() || limits_length(); }
};

class Effect;

/// A known effect, or a known fault of the readings' map, as the robot file lists it: in the file's
/// own units. What it means is up to effects/ (schema.hpp has the names, applied.hpp applies it).
struct AppliedEffect {
  struct Parameter {
    std::string name;            ///< with the unit as suffix: "bias_N"
    std::vector<double> values;  ///< nested lists one after the other
  };
  std::string name;
  std::string run;  ///< file name of the one log it belongs to (yaw drift, creep); empty: every log
  std::vector<Parameter> parameters;
};

struct Robot {
  std::string name;
  double gravity_m_s2 = 9.81;
  Platform platform;
  std::vector<Cable> cables;
  double tension_min_N = 0.0;
  double tension_max_N = 0.0;
  Surroundings surroundings;
  EulerConvention euler_convention = EulerConvention::XYZ;
  SensorSigma sigma;
  std::vector<AppliedEffect> effects;  ///< known beyond the ideal model; calibration applies them
  /// Effects that its file defines as text (effects/text_effect.hpp), beside the catalogue.
  std::vector<std::shared_ptr<const Effect>> own_effects;

  [[nodiscard]] int cable_count() const { return static_cast<int>(cables.size()); }
  [[nodiscard]] double weight_N() const { return platform.mass_kg * gravity_m_s2; }
  /// Weight as a force in world axes [N]; z points up.
  [[nodiscard]] Vector3 gravity_force_N() const { return {0.0, 0.0, -weight_N()}; }
};

/// Largest distance between pulleys or, when that is 0, of the platform's anchors [m].
double robot_size_m(const Robot& robot);
/// The box of the pulleys' places.
Box pulley_box(const Robot& robot);
/// Mean of the pulleys' places; 0 without cables.
Vector3 middle_of_pulleys(const Robot& robot);
/// How far from P the farthest of the anchors and the centre of mass is [m].
double platform_reach_m(const Robot& robot);
/// Root mean square distance of the platform anchors from the centre of mass [m] (1 when all are at
/// it): turns moments into forces.
double characteristic_length_m(const Robot& robot);

/// Checks every field (finite, positive, consistent), makes the pulley axes orthonormal (x_axis is
/// turned to be exactly perpendicular to swivel_axis; more than 1e-3 off is an error) and derives
/// the defaults that depend on others. Finalising twice changes no bit.
/// Throws InputError naming the field. The robot-file reader calls it; call it after editing by
/// hand, and check_effects (effects/schema.hpp) where `effects` was edited.
void finalise(Robot& robot);

}  // namespace cdprcal
