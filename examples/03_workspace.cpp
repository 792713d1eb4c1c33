// Everywhere the platform can hang: the static workspace, its boundary, the largest box inside.
#include "cdprcal/workspace/workspace.hpp"

#include <cstdio>

#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/workspace/inscribed_box.hpp"
#include "cdprcal/workspace/workspace_shape.hpp"

int main() {
  using namespace cdprcal;
  const Robot robot = load_robot("irma4");
  WorkspaceOptions options;
  options.step_m = 0.1;
  const Workspace workspace = compute_workspace(robot, options);
  if (workspace.points_inside() == 0) {
    std::puts(explain_empty(workspace).c_str());
    return 1;
  }
  std::printf("points: %lld %lld\n", static_cast<long long>(workspace.points_inside()),
              static_cast<long long>(workspace.points_tested));

  const AlphaShape shape = workspace_shape(workspace);  // around the points, watertight
  std::printf("volume_m3: %.4f\n", shape.volume_m3);

  const std::optional<Box> box = largest_inscribed_box(workspace);
  if (!box) return 1;
  std::printf("box_m: %.3f %.3f %.3f %.3f %.3f %.3f\n", box->lower_m.x(), box->lower_m.y(),
              box->lower_m.z(), box->upper_m.x(), box->upper_m.y(), box->upper_m.z());
}
