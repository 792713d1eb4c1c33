// The same robot, larger: what a diagnosis, a calibration or a simulation must not notice.
#pragma once

#include "cdprcal/readings/log.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal::test {

/// Factors of masses (and so of forces) and of lengths.
struct Scaling {
  double mass = 1.0, length = 1.0;
};

/// Geometry, inertia, tension limits and the σ of sensors grow; σ of the balance is the default.
inline Robot scaled(Robot robot, const Scaling& by) {
  robot.platform.mass_kg *= by.mass;
  robot.platform.centre_of_mass_m *= by.length;
  robot.platform.inertia_kg_m2 *= by.mass * by.length * by.length;
  for (Cable& cable : robot.cables) {
    cable.pulley.position_m *= by.length;
    cable.pulley.radius_m *= by.length;
    cable.platform_anchor_m *= by.length;
  }
  robot.tension_min_N *= by.mass;
  robot.tension_max_N *= by.mass;
  for (const Sensor& sensor : kSensorTable) {
    if (!sensor.sigma || sensor.is_angle()) continue;
    robot.sigma.*sensor.sigma *= sensor.unit[0] == 'm' ? by.length : by.mass;
  }
  robot.sigma.wrench_force_N = robot.sigma.wrench_moment_Nm = 0.0;
  finalise(robot);
  return robot;
}

/// What it would read, at the same times.
inline Log scaled(Log log, const Scaling& by) {
  log.length_m *= by.length;
  log.tension_N *= by.mass;
  log.tension_setpoint_N *= by.mass;
  return log;
}

}  // namespace cdprcal::test
