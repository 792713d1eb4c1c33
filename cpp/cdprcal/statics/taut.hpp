// From which tension on a cable counts as taut.
#pragma once

#include <algorithm>

#include "cdprcal/model/robot.hpp"

namespace cdprcal {

/// Half of the least tension that the robot is run with, and no less than 1 % of the platform's
/// weight: below it a cable sags, and neither its length nor its direction is the straight line's.
inline double taut_tension_N(const Robot& robot) {
  return std::max(0.5 * robot.tension_min_N, 0.01 * robot.weight_N());
}

}  // namespace cdprcal
