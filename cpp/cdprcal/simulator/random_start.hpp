// Where a robot may hang when it is switched on.
#pragma once

#include <cstdint>
#include <optional>

#include "cdprcal/planning/set_point.hpp"
#include "cdprcal/workspace/grid.hpp"

namespace cdprcal {

/// A position drawn evenly from `box` at which the robot hangs within its tension limits, up to
/// five cables stable at constant tensions; the same for the same seed. Nothing when `tries`
/// positions were none. Throws InputError for robots without an inverse problem (n < 3).
std::optional<SetPoint> random_start(const Robot& robot, const Box& box, std::uint64_t seed,
                                     int tries = 200);

/// Where a robot of six cables and more may have been parked for a run that begins at a pose: as
/// well as people park by eye, within kParked of the robot's size and kParkedTurn_rad of the pose,
/// evenly along and about each axis, and wrench-feasible. Nothing when `tries` poses were not.
/// Throws InputError for fewer cables.
std::optional<SetPoint> parked_start(const Robot& robot, const Pose& meant, std::uint64_t seed,
                                     int tries = 200);
inline constexpr double kParked = 0.005;
inline constexpr double kParkedTurn_rad = 0.75 * kDegree;

}  // namespace cdprcal
