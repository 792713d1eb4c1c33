#include "cdprcal/planning/candidates.hpp"

#include <algorithm>

#include "cdprcal/planning/pose_grid.hpp"

namespace cdprcal {
namespace {

constexpr double kPositions = 2000.0;

/// Counts with about equal steps along all axes and about kPositions in all.
std::array<int, 3> counts_for(const Box& box) {
  const Vector3 extent = box.upper_m - box.lower_m;
  const double step = even_step_m(box, kPositions);
  std::array<int, 3> counts{1, 1, 1};
  for (int axis = 0; axis < 3; ++axis) {
    if (!(extent[axis] > 0.0)) continue;
    counts[axis] = std::max(2, static_cast<int>(std::lround(extent[axis] / step)) + 1);
  }
  return counts;
}

}  // namespace

ReachableSetPoints reachable_set_points(const PathChecker& checker, const SetPoint& start,
                                        const std::optional<Box>& box,
                                        const std::function<bool(double)>& progress) {
  const SetPointSolver& solver = checker.solver();
  const Box region = in_plane(solver.robot(), box.value_or(workspace_box(solver.robot())));
  const std::vector<Vector3> positions = grid_positions(region, counts_for(region));
  ReachableSetPoints out;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (progress && !progress(static_cast<double>(i) / static_cast<double>(positions.size()))) {
      out.stopped = true;
      return out;
    }
    const auto result = solver.at(positions[i]);
    if (result.set_point && survives_tension_error(solver, *result.set_point) &&
        checker.follow(start, *result.set_point).clear()) {
      out.set_points.push_back(*result.set_point);
    }
  }
  return out;
}

}  // namespace cdprcal
