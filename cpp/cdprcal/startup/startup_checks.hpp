// Private to startup/: what a start-up cannot be run with.
#pragma once

#include "cdprcal/startup/startup.hpp"

namespace cdprcal {

/// Cables may cross a fifth of the robot's size per second: the mean distance of the pulleys from
/// their middle. For a robot of 1.6 m that is 0.32 m/s.
double derived_velocity_m_s(const Robot& robot);

/// Throws InputError for impossible options.
void check_options(const StartUpOptions& o);

/// Throws InputError for a plan that does not fit the robot; fills in missing transition times (0).
void check_plan(const Robot& robot, StartUpPlan& plan);

}  // namespace cdprcal
