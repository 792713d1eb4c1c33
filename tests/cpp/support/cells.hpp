// A robot of eight cables for tests that is held from above and below; posts8 hangs.
#pragma once

#include "cdprcal/model/robot.hpp"

namespace cdprcal::test {

/// A cell of 4 × 4 × 3 m with pulleys in all corners. Cables cross each other: from above to the
/// lower side of the platform, from below to the upper one, as real cells have it. At constant
/// tensions it would turn over.
inline Robot eight_cable_cell() {
  Robot robot;
  robot.name = "cell8";
  robot.platform.mass_kg = 20.0;
  robot.platform.centre_of_mass_m = {0.01, -0.02, 0.03};
  robot.platform.inertia_kg_m2 = Vector3(0.8, 0.9, 1.0).asDiagonal();
  for (int i = 0; i < 8; ++i) {
    const double x = i % 2 == 0 ? 1.0 : -1.0, y = i / 2 % 2 == 0 ? 1.0 : -1.0;
    const bool above = i < 4;
    Cable cable;
    cable.pulley.radius_m = 0.03;
    cable.pulley.position_m = {2.0 * x, 2.0 * y, above ? 3.0 : 0.0};
    const Vector3 inward = Vector3(-x, -y, 0.0).normalized();
    const Vector3 k(0.0, 0.0, above ? -1.0 : 1.0);
    cable.pulley.axes_world << inward, k.cross(inward), k;
    cable.platform_anchor_m =
        above ? Vector3(0.3 * x, 0.1 * y, -0.25) : Vector3(-0.1 * x, 0.3 * y, 0.25);
    robot.cables.push_back(cable);
  }
  robot.tension_min_N = 50.0;
  robot.tension_max_N = 1000.0;
  finalise(robot);
  return robot;
}

}  // namespace cdprcal::test
