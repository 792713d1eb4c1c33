// The catalogue as text: examples/effects/catalogue.yaml.
#pragma once

#include <filesystem>

#include "cdprcal/robot_file/effect_definitions.hpp"

namespace cdprcal::test {

inline std::vector<std::shared_ptr<const Effect>> written_catalogue() {
  const auto root = std::filesystem::path(__FILE__).parent_path() / "../../..";
  static const auto all =
      load_effects((root / "examples/effects/catalogue.yaml").lexically_normal().string());
  return all;
}

}  // namespace cdprcal::test
