// Stand-ins for what the catalogue does not know: "this channel depends on that".
#pragma once

#include "cdprcal/diagnosis/model.hpp"

namespace cdprcal {

/// One candidate for each channel group and each thing it may depend on (time, position, tension,
/// direction of motion). They compete with the catalogue: where one explains the readings better
/// than every named effect, the honest answer is "unexplained", with its channel and dependence.
const Candidates& generic_candidates();

/// Whether an effect is one of these, and then "length" … and "time" … .
struct GenericName {
  std::string channel, depends_on;
};
std::optional<GenericName> generic_name(const Effect& effect);

}  // namespace cdprcal
