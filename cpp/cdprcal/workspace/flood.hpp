// The two passes over the grid that make a workspace. Called by compute_workspace.
#pragma once

#include <cstdint>
#include <vector>

#include "cdprcal/workspace/workspace.hpp"

namespace cdprcal {

/// Tests the seeds (grid indices, sorted, each once) and everything that can be reached from those
/// inside by steps along the grid's axes, each point continued from a solved neighbour. Fills the
/// workspace's arrays. False when options.progress said stop. Same result for any thread count.
bool flood_workspace(const InverseSolver& solver, const WorkspaceOptions& options,
                     const std::vector<std::int64_t>& seeds, Workspace& workspace);

/// Locates the boundary by bisection along the grid's edges between points inside and whatever is
/// not, or the face of the box: fills boundary_m. False when options.progress said stop.
bool refine_boundary(const InverseSolver& solver, const WorkspaceOptions& options,
                     Workspace& workspace);

}  // namespace cdprcal
