// Set-points to choose from by observability: everything that can be commanded safely.
#pragma once

#include <functional>
#include <vector>

#include "cdprcal/planning/path.hpp"

namespace cdprcal {

struct ReachableSetPoints {
  std::vector<SetPoint> set_points;
  bool stopped = false;
};

/// Set-points on a regular grid (about 2000 positions) that survive a tension error of one σ
/// (survives_tension_error) and to which the path from `start` is clear. In `box`, or in the whole
/// static workspace within the pulleys' box (workspace_box). `progress` is called with the share
/// done; false stops.
ReachableSetPoints reachable_set_points(const PathChecker& checker, const SetPoint& start,
                                        const std::optional<Box>& box,
                                        const std::function<bool(double)>& progress = {});

}  // namespace cdprcal
