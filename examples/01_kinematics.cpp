// A robot, a pose, and what its sensors read there (paper eqs 1-6).
#include <cstdio>

#include "cdprcal/geometry/euler.hpp"
#include "cdprcal/kinematics/platform.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/statics/tension.hpp"

int main() {
  using namespace cdprcal;
  const Robot robot = load_robot("irma4");  // built in; else the path of a robot file
  Pose pose;
  pose.position_m = {0.4, 0.4, 1.2};  // Table II, row 1
  pose.rotation = rotation_from_euler({0.084023, -0.090510, 0.004690}, EulerConvention::XYZ);

  const PlatformState state = platform_state(robot, pose);
  if (!state.valid) {
    std::puts(describe_invalid(state).c_str());
    return 1;
  }
  const auto print = [](const char* name, const CableVector& values, const char* format) {
    std::printf("%s:", name);
    for (double value : values) std::printf(format, value);
    std::puts("");
  };
  print("lengths_m", state.length_m(), " %.6f");
  print("swivels_rad", state.swivel_rad(), " %.6f");

  // Tensions that carry the weight here, by all six equations of the balance.
  print("tensions_N", tensions_least_squares(robot, state).tension_N, " %.4f");
}
