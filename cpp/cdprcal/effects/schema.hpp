// What the `effects:` section of a robot file may hold: names, parameters, shapes. No physics, so
// that model/ can read and write it without knowing what an effect does.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cdprcal/model/robot.hpp"

namespace cdprcal {

/// One parameter: its key in the file and how its numbers are nested: {} one number, {n} a list,
/// {n, 3} a list of n lists of three.
struct ParameterLayout {
  std::string name;
  std::vector<int> shape;
  bool optional = false;
  [[nodiscard]] std::size_t size() const;
};

/// One effect of the catalogue, or one fault of the readings' map (reading_faults.hpp).
struct EffectLayout {
  std::string name;
  std::vector<ParameterLayout> parameters;
  bool by_run = false;  ///< differs from run to run: may be given for one log alone
};

/// All that a robot with n cables may list, in the order of the catalogue; faults last.
std::vector<EffectLayout> effect_layouts(int cables);
/// The one called `name`, if there is one.
std::optional<EffectLayout> effect_layout(const std::string& name, int cables);

/// What to say of a name that is not known: the nearest ones, or all.
std::string unknown_effect(const std::string& name);

/// Checks robot.effects (names, parameters, sizes, values) and that the robot they make is one.
/// Throws InputError naming the field. For a robot that `finalise` has seen.
void check_effects(const Robot& robot);

namespace detail {
/// The same, throwing FieldError.
void check_effects(const Robot& robot);
}  // namespace detail

}  // namespace cdprcal
