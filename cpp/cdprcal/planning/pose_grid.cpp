#include "cdprcal/planning/pose_grid.hpp"

#include <algorithm>

#include "cdprcal/equilibria/wrench_distribution.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/text.hpp"
#include "cdprcal/workspace/inscribed_box.hpp"

namespace cdprcal {
namespace {

constexpr std::int64_t kMostPositions = 100'000;
constexpr double kSameRobot_m = 0.05;  ///< more than any calibration moves an anchor
constexpr int kWorkspaceSteps = 24;    ///< along the shortest side of the searched box

/// Paper eq. 19.
const Box kIrma4Box{{-0.4, -0.4, 0.6}, {0.4, 0.4, 1.2}};

Box scaled(const Box& box, double factor) {
  const Vector3 middle = 0.5 * (box.lower_m + box.upper_m);
  const Vector3 half = 0.5 * factor * (box.upper_m - box.lower_m);
  return {middle - half, middle + half};
}

/// Whether all positions of a grid in the box may be commanded.
bool is_safe(const SetPointSolver& solver, const Box& box) {
  for (const Vector3& position : grid_positions(box, in_plane(solver.robot(), {3, 3, 3}))) {
    const auto result = solver.at(position);
    if (!result.set_point || !survives_tension_error(solver, *result.set_point)) return false;
  }
  return true;
}

Workspace coarse_workspace(const Robot& robot, const SetPointOptions& options,
                           const std::function<bool()>& proceed) {
  WorkspaceOptions search;
  const Box box = workspace_box(robot);
  if (!axis_across(robot) && !((box.upper_m - box.lower_m).minCoeff() > 0.0)) {
    throw InputError(
        "measurement box: the pulleys are in one vertical plane, so none can be "
        "proposed; give a box");
  }
  search.step_m = least_side_m(box) / kWorkspaceSteps;
  search.boundary_halvings = 0;
  search.inverse.distribution = options.distribution;
  search.inverse.lambda_N = options.lambda_N;
  search.inverse.rotation = options.rotation;
  if (!holds_orientation(robot)) search.inverse.stability = StabilityNotion::constant_tensions;
  if (proceed) search.progress = [&](const WorkspaceProgress&) { return proceed(); };
  return compute_workspace(robot, search);
}

}  // namespace

std::string in_words(const Vector3& p) {
  return printed("(%.3g, %.3g, %.3g) m", p.x(), p.y(), p.z());
}

std::vector<Vector3> grid_positions(const Box& box, const std::array<int, 3>& counts) {
  const Vector3 extent = box.upper_m - box.lower_m;
  std::int64_t total = 1;
  for (int axis = 0; axis < 3; ++axis) {
    if (counts[axis] < 1) throw InputError("grid: at least 1 position in each direction");
    total *= counts[axis];
    if (total > kMostPositions) {
      throw InputError("grid: must have at most " + std::to_string(kMostPositions) + " positions");
    }
    const bool wide = counts[axis] == 1 ? extent[axis] >= 0.0 : extent[axis] > 0.0;
    if (!wide || !box.lower_m.allFinite() || !box.upper_m.allFinite()) {
      throw InputError("grid: the box from " + in_words(box.lower_m) + " to " +
                       in_words(box.upper_m) + " is empty along " + std::string(1, "xyz"[axis]) +
                       ": its lower corner must be below its upper one");
    }
  }
  const auto coordinate = [&](int axis, int step) {  // counted from the upper face
    if (counts[axis] == 1) return 0.5 * (box.lower_m[axis] + box.upper_m[axis]);
    const double fraction = static_cast<double>(step) / (counts[axis] - 1);
    return (1.0 - fraction) * box.upper_m[axis] + fraction * box.lower_m[axis];
  };
  std::vector<Vector3> positions;
  positions.reserve(static_cast<std::size_t>(total));
  for (int k = 0; k < counts[2]; ++k) {
    for (int j = 0; j < counts[1]; ++j) {
      const int y = k % 2 == 0 ? j : counts[1] - 1 - j;
      const bool forward = (k * counts[1] + j) % 2 == 0;
      for (int i = 0; i < counts[0]; ++i) {
        const int x = forward ? i : counts[0] - 1 - i;
        positions.emplace_back(coordinate(0, x), coordinate(1, y), coordinate(2, k));
      }
    }
  }
  return positions;
}

std::optional<Box> published_measurement_box(const Robot& robot) {
  if (robot.name != "irma4" || robot.surroundings.any()) return std::nullopt;
  const Robot irma4 = load_robot("irma4");
  if (robot.cable_count() != irma4.cable_count()) return std::nullopt;
  for (int i = 0; i < irma4.cable_count(); ++i) {
    const Cable& a = robot.cables[i];
    const Cable& b = irma4.cables[i];
    if ((a.pulley.position_m - b.pulley.position_m).norm() > kSameRobot_m ||
        (a.platform_anchor_m - b.platform_anchor_m).norm() > kSameRobot_m) {
      return std::nullopt;
    }
  }
  return kIrma4Box;
}

BoxProposal propose_measurement_box(const Robot& robot, const SetPointOptions& options,
                                    const std::function<bool()>& proceed) {
  BoxProposal proposal;
  if (const auto box = published_measurement_box(robot)) {
    proposal.box = box;
    proposal.reason = "the box that was published for " + robot.name + " (eq. 19)";
    return proposal;
  }
  const SetPointSolver solver(robot, options);
  const Workspace workspace = coarse_workspace(robot, options, proceed);
  if (!workspace.complete) {
    proposal.stopped = true;
    proposal.reason = "stopped";
    return proposal;
  }
  const std::optional<Box> inscribed = largest_inscribed_box(workspace);
  if (!inscribed) {
    const std::string why = explain_empty(workspace);
    proposal.reason = "no box fits into the static workspace" + (why.empty() ? "" : ": " + why);
    return proposal;
  }
  constexpr double kShrink = 0.95;
  constexpr double kSmallest = 0.05;  ///< below this the poses hardly differ
  for (double factor = kShrink; factor >= kSmallest; factor *= kShrink) {
    if (proceed && !proceed()) {
      proposal.stopped = true;
      proposal.reason = "stopped";
      return proposal;
    }
    const Box box = scaled(*inscribed, factor);
    if (!is_safe(solver, box)) continue;
    proposal.box = box;
    proposal.reason = "the largest box inscribed in the static workspace, shrunk to " +
                      std::to_string(static_cast<int>(std::lround(100.0 * factor))) +
                      " % so that " +
                      (holds_orientation(robot) ? "an error of the lengths" : "a tension error") +
                      " of one sigma keeps the platform inside";
    return proposal;
  }
  proposal.reason =
      "in no box inscribed in the static workspace can every set-point keep its margin to the "
      "tension limits and survive a tension error of one sigma of the load cells; give a box, or a "
      "smaller margin, or the load cells' true sigma";
  return proposal;
}

}  // namespace cdprcal
