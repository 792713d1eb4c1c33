// What is in the way: floor, keep-out boxes and limits of length of the robot file.
#pragma once

#include <string>

#include "cdprcal/kinematics/platform.hpp"

namespace cdprcal {

/// Whether a pose keeps clear of the robot's surroundings. The platform is the box along the
/// world's axes around P, its anchors and its outline there, which is more than itself; a cable is
/// the straight line from where it leaves the pulley to its anchor. `state` is that of `pose`; one
/// that is not valid is not clear where lengths are limited. No heap.
bool is_clear(const Robot& robot, const Pose& pose, const PlatformState& state);

/// What is in the way there, in words ("cable 2 passes through keep_out[#1]"); empty: nothing is.
std::string obstruction(const Robot& robot, const Pose& pose, const PlatformState& state);

}  // namespace cdprcal
