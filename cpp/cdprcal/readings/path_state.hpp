// From which side each cable and each swivel came to where it is: what hysteresis depends on.
#pragma once

#include "cdprcal/model/robot.hpp"
#include "cdprcal/readings/log.hpp"

namespace cdprcal {

/// s in [−1, 1] a sample and cable: +1 after paying out (or turning positive) by more than the
/// turn-over distance, −1 the other way, between them while turning over; a dwell keeps it. What
/// came before power-on is unknown: until the first motion, s is anything from −1 to 1, then what
/// that leaves of this range; 0 and the middle of the range stand for it. A play operator on the
/// smoothed reading: the turn-over distance is 1 mm of cable over pulleys as large as irma4's (0.5°
/// of swivel), and motion within a dead band of the noise that smoothing leaves is none. With one σ
/// of dead band noise turns s over now and then, with three true reversals are missed. s is the
/// mean of both, and half their difference is kept beside it.
struct PathState {
  LogMatrix length_direction;                                ///< [N, n] or [N, 0]
  LogMatrix swivel_direction;                                ///< [N, n] or [N, 0]
  LogMatrix length_direction_error, swivel_direction_error;  ///< s of one σ − s: what it may be off
  LogMatrix length_direction_open, swivel_direction_open;    ///< half the range that s may be in
  /// [N, n], attitude [N, 3], or [N, 0]: slopes over ±0.3 s.
  LogMatrix length_rate_m_s, swivel_rate_rad_s, attitude_rate_rad_s;
};

/// `robot`: for how far its cables go to turn friction over.
PathState path_state(const Robot& robot, const Log& log, double smoothing_s = 1.0);

}  // namespace cdprcal
