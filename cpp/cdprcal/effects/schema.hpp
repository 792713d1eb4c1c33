// What the `effects:` section of a robot file may hold: names, parameters, shapes. No physics, so
// that model/ can read and write it without knowing what an effect does.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cdprcal/effects/parameter.hpp"
#include "cdprcal/model/robot.hpp"

namespace cdprcal {

/// One effect of the catalogue, or one fault of the readings' map (reading_faults.hpp).
struct EffectLayout {
  std::string name;
  std::vector<ParameterLayout> parameters;
};

/// All that a robot may list, in the order of the catalogue; faults last.
const std::vector<EffectLayout>& effect_layouts();
EffectLayout layout_of(const Effect& effect);
/// The one called `name`, of these or of the robot's own; nothing where there is none.
std::optional<EffectLayout> effect_layout(const Robot& robot, const std::string& name);

/// What to say of a name that is not known.
std::string unknown_effect(const Robot& robot, const std::string& name);

/// Checks robot.effects (names, parameters, sizes, values) and that the robot they make is one.
/// Throws InputError naming the field. For a robot that `finalise` has seen.
void check_effects(const Robot& robot);

namespace detail {
/// The same, throwing FieldError.
void check_effects(const Robot& robot);
}  // namespace detail

}  // namespace cdprcal
