// What happens once, at one time, and is found in the log before any fit.
#pragma once

#include <string>
#include <vector>

#include "cdprcal/model/robot.hpp"
#include "cdprcal/readings/log.hpp"

namespace cdprcal {

/// One event of a log. Its readings say nothing about the model and are left out.
struct LogEvent {
  std::string name;  ///< outlier, slack, oscillation
  double begin_s = 0.0, end_s = 0.0;
  int cable = -1;       ///< from 0; −1: none
  std::string channel;  ///< of an outlier: length, swivel, tension, roll, pitch, yaw
  double size = 0.0;    ///< outlier: how far off [m, rad, N]; slack: least tension [N]
};
std::string describe(const LogEvent& event);

/// Looks through the run (the last segment) for
/// - outliers: readings/outliers.hpp
/// - slack: readings one after the other of a cable that is not taut, beyond what noise could make
///   of one that is (where cables push, beyond the σ of the robot file). One reading alone is
///   slack, too, when it stands out, is zero within its noise, and the platform jerks then: a
///   tension loop takes up what hangs loose faster than a log has samples;
/// - oscillation: a rest that a swing interrupts, or a swing between two rests of one set-point.
/// Outliers, and readings of such short slack, come back as NaN in `log`.
std::vector<LogEvent> gate_events(const Robot& robot, Log& log);

}  // namespace cdprcal
