// Stand-ins for what the catalogue does not know: "this channel depends on that".
#pragma once

#include <optional>

#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

/// Candidates for each channel group and each thing it may depend on: time, position, tension,
/// direction of motion, the reading itself; alike in all cables or cable by cable, straight or
/// bent. They compete with the catalogue: where one explains the readings better than every named
/// effect, the honest answer is "unexplained", with its channel and dependence. What they depend on
/// is centred and scaled by what the model's runs visited.
Candidates generic_candidates(const DiagnosisModel& model);

/// Whether an effect is one of these, and then "length" … and "time" … .
struct GenericName {
  std::string channel, depends_on;
};
std::optional<GenericName> generic_name(const Effect& effect);

}  // namespace cdprcal
