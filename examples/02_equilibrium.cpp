// Where the platform hangs: from a position to tensions, and from tensions back to the pose.
#include <cstdio>
#include <numbers>

#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/equilibria/inverse.hpp"
#include "cdprcal/geometry/euler.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

int main() {
  using namespace cdprcal;
  const Robot robot = load_robot("irma4");

  // Inverse problem (eqs A1-A3): orientation and tensions that hold the platform at a position.
  const InverseResult held = inverse(robot, {0.3, -0.2, 0.8});
  if (held.status != EquilibriumStatus::found) {
    std::puts(held.reason.c_str());
    return 1;
  }
  const Vector3 angles_deg =
      euler_from_rotation(held.pose.rotation_matrix(), robot.euler_convention) * 180.0 /
      std::numbers::pi;
  std::printf("angles_deg: %.4f %.4f %.4f\n", angles_deg.x(), angles_deg.y(), angles_deg.z());
  std::printf("tensions_N:");
  for (double tension_N : held.tension_N) std::printf(" %.4f", tension_N);
  std::puts("");

  // Direct problem: command these tensions, and the platform settles there again, from anywhere.
  const EquilibriumResult settled = direct_from_tensions(robot, held.tension_N);
  if (settled.status != EquilibriumStatus::found) {
    std::puts(settled.reason.c_str());
    return 1;
  }
  const Vector3& position_m = settled.pose.position_m;
  std::printf("position_m: %.5f %.5f %.5f\n", position_m.x(), position_m.y(), position_m.z());

  // How firmly: with locked winches (eq. A4), and under force control.
  std::printf("stiffness_N_m: %.2f %.2f\n", held.stability.locked_lengths_N_m,
              held.stability.constant_tensions_N_m);
}
