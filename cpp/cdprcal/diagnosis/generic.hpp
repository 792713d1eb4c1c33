// Stand-ins for what the catalogue does not know: "this channel depends on that".
#pragma once

#include <optional>

#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

/// Size to expect of a dependence over a run, of a channel of the paper's sensors: that of typical
/// effects on irma4 [m, rad, rad, rad, N], and what it grows with. As for the catalogue, a prior's
/// σ; no threshold depends on it.
struct DependenceSize {
  double typical;
  Yardstick of;
};
DependenceSize dependence_size(Channel channel);

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
