// Where a robot may hang when it is switched on.
#pragma once

#include <cstdint>
#include <optional>

#include "cdprcal/planning/set_point.hpp"
#include "cdprcal/workspace/grid.hpp"

namespace cdprcal {

/// A position drawn evenly from `box` at which the robot hangs within its tension limits, stable at
/// constant tensions; the same for the same seed. Nothing when `tries` positions were none. Throws
/// InputError for robots without an inverse problem (n < 3, n > 5).
std::optional<SetPoint> random_start(const Robot& robot, const Box& box, std::uint64_t seed,
                                     int tries = 200);

}  // namespace cdprcal
