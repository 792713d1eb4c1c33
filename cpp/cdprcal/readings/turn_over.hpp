// How far a cable or a swivel goes until what drags along has turned over to the other side.
#pragma once

#include <algorithm>

#include "cdprcal/model/yardstick.hpp"

namespace cdprcal {

/// On irma4. What turns over is elastic: it gives way by an angle of the pulley.
inline constexpr double kTurnOver_m = 1e-3;
inline constexpr double kTurnOver_rad = 0.5 * kDegree;

/// How far it has turned over, in [−1, 1], after `travel` more: the play operator, which goes from
/// one side to the other within `distance`.
inline double turned_over(double state, double travel, double distance) {
  return std::clamp(state + 2.0 * travel / distance, -1.0, 1.0);
}

/// Of a robot's cables.
inline double turn_over_m(const Robot& robot) {
  return kTurnOver_m * times_reference(Yardstick::pulley, robot);
}

}  // namespace cdprcal
