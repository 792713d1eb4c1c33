// Faults of the readings' map itself: a sign, an order, a unit, a zero or a mounting that nobody
// entered. Not small, not physical, and set right before anything else looks at a log.
#pragma once

#include <string>
#include <vector>

#include "cdprcal/effects/parameter.hpp"
#include "cdprcal/model/robot.hpp"
#include "cdprcal/readings/log.hpp"

namespace cdprcal {

/// One of these, as the robot file lists it. A new one: a row here, and one of the plant.
struct ReadingFault {
  const char* name;
  std::vector<ParameterLayout> parameters;
  /// Makes a log of the robot what it would be without the fault, which must be valid for the
  /// log's cables.
  void (*set_right)(const AppliedEffect& fault, const Robot& robot, Log& log);
};
/// Those of lengths are of whole ones where a log has no changes of length. The Euler convention is
/// none of them: it has its own place, sensors.euler_convention.
const std::vector<ReadingFault>& reading_faults();

/// Whether `name` is one of these.
bool is_reading_fault(const std::string& name);

/// The robot without those that it lists: for logs that are set right already, or are to be read as
/// they are.
Robot without_reading_faults(Robot robot);

/// ReadingFault::set_right of the row of that name.
void set_right(const AppliedEffect& fault, const Robot& robot, Log& log);

}  // namespace cdprcal
