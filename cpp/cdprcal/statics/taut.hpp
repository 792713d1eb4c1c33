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

/// So many σ of a reading are doubt, not tension.
inline constexpr double kSlackDoubt = 3.0;

/// No cable pushes: below this a reading of that σ shows that the load cell is off.
inline double pushing_below_N(const Robot& robot, double sigma_N) {
  return -std::max(taut_tension_N(robot), kSlackDoubt * sigma_N);
}

/// Below this a reading of that σ shows a cable that may hang slack: what is not taut, and what
/// noise could make of nothing. Where noise could make nothing of a tension that is allowed, too,
/// the reading cannot tell one from the other, and to leave out the low ones would make the rest
/// too high on average: then only what noise cannot make of any tension allowed.
inline double slack_level_N(const Robot& robot, double sigma_N) {
  const double taut_N = taut_tension_N(robot);
  const double doubt_N = kSlackDoubt * sigma_N;
  const double allowed_N = std::max(taut_N, robot.tension_min_N);
  return doubt_N <= allowed_N ? std::max(taut_N, doubt_N) : allowed_N - doubt_N;
}

}  // namespace cdprcal
