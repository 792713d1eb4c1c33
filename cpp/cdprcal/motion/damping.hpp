// What holds a moving platform back.
#pragma once

#include "cdprcal/effects/effect.hpp"

namespace cdprcal {

/// Forces 2m/T v of the centre of mass, moments 2I/T ω, with T the times in which a free
/// oscillation falls to 1/e; the values are 1/T of each. No effect of the catalogue: every platform
/// has some, and no robot file says how much.
std::shared_ptr<const Effect> damping();

}  // namespace cdprcal
