// Private to robot_file/: the list of effects that a file defines as text.
#pragma once

#include "cdprcal/effects/text_effect.hpp"
#include "cdprcal/robot_file/yaml_reader.hpp"

namespace cdprcal::detail {

std::vector<std::shared_ptr<const Effect>> read_definitions(const YamlField& list);

}  // namespace cdprcal::detail
