// Faults of the readings' map itself: a sign, an order, a unit. Not small, not physical, and set
// right before anything else looks at a log.
#pragma once

#include <string>

#include "cdprcal/model/robot.hpp"
#include "cdprcal/readings/log.hpp"

namespace cdprcal {

/// Whether `name` is one of these, as the robot file lists them:
///   length_sign, swivel_sign {sign}   ±1 a cable
///   cable_order {order}               cable i is read on channel order[i], counted from 1
///     and {tension_order}             the same of its load cell, where that is not order
///   length_unit {factor}              readings × factor are metres
///   angle_unit {factor}               two: of the swivels, and of the attitude, to radians
/// The Euler convention is none of them: it has its own place, sensors.euler_convention.
bool is_reading_fault(const std::string& name);

/// What is wrong with a fault's values; empty when nothing is.
std::string fault_problem(const AppliedEffect& fault);

/// The robot without those that it lists: for logs that are set right already, or are to be read as
/// they are.
Robot without_reading_faults(Robot robot);

/// The log as it would read without the fault. The fault must be valid for the log's cables.
void set_right(const AppliedEffect& fault, Log& log);

}  // namespace cdprcal
