// Stands for somebody else's program: it has the installed headers and the installed library,
// nothing of this tree.
#include <cdprcal/calibration/calibrate.hpp>
#include <cdprcal/kinematics/platform.hpp>
#include <cdprcal/robot_file/robot_file.hpp>
#include <cdprcal/version.hpp>

#include <iostream>

int main() {
  const cdprcal::Robot robot = cdprcal::load_robot("irma4");
  cdprcal::Pose pose;
  pose.position_m = {0.4, 0.4, 1.2};
  const cdprcal::PlatformState state = cdprcal::platform_state(robot, pose);
  if (!state.valid) {
    std::cerr << cdprcal::describe_invalid(state) << '\n';
    return 1;
  }
  std::cout << "cdprcal " << cdprcal::version << ": " << robot.name << " has cables of "
            << state.length_m().transpose() << " m\n";
}
