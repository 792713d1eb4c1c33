// Effects written as text, in a robot file or in a file of their own: the key effect_definitions.
#pragma once

#include "cdprcal/effects/text_effect.hpp"

namespace cdprcal {

/// A list of {name; parameters: {parameter: {per: cable | common (the default), typical,
/// plausible}}; adds: {target: formula}; and, where they help: says, remedy, settle, scope: robot
/// (the default) | run, one_sided} under the key effect_definitions, as a robot file may have it
/// too. Throws InputError "source:line:column: field: what is wrong and what to do".
std::vector<std::shared_ptr<const Effect>> parse_effects(const std::string& yaml_text,
                                                         const std::string& source);
/// The same of a file.
std::vector<std::shared_ptr<const Effect>> load_effects(const std::string& path);

/// The robot with more effects of its own; those that it has by the same name give way. Throws
/// InputError where a value that the robot lists does not fit its effect any more.
Robot with_own_effects(Robot robot, const std::vector<std::shared_ptr<const Effect>>& effects);

/// A list that parse_effects reads back, with its key; empty for none of text.
std::string effects_to_yaml(const std::vector<std::shared_ptr<const Effect>>& effects);

}  // namespace cdprcal
