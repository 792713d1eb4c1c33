// All effects the project knows, by name.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "cdprcal/effects/effect.hpp"

namespace cdprcal {

/// One row an effect file. A new effect: its file, one declaration and one row in catalogue.cpp.
const std::vector<std::shared_ptr<const Effect>>& effect_catalogue();

/// Those of the catalogue, then the robot's own.
std::vector<std::shared_ptr<const Effect>> effects_of(const Robot& robot);

/// Of the catalogue, or of a robot. Throws InputError naming the known effects.
std::shared_ptr<const Effect> find_effect(const std::string& name);
std::shared_ptr<const Effect> find_effect(const Robot& robot, const std::string& name);

}  // namespace cdprcal
