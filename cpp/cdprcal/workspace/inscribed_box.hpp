// The largest axis-aligned box inscribed in a workspace.
#pragma once

#include <optional>

#include "cdprcal/workspace/workspace.hpp"

namespace cdprcal {

/// The box of largest volume whose corners are grid points and whose grid points, all of them, are
/// inside the workspace. Empty when no grid cell has all its corners inside. Of boxes of equal
/// volume the first in the order of z, y, x. Maximal rectangles of histograms, for every pair of
/// grid planes of the shortest side: exact, O(n_min · number of points).
std::optional<Box> largest_inscribed_box(const Workspace& workspace);

/// Whether every grid cell that a box touches has all its corners inside.
bool box_is_inside(const Workspace& workspace, const Box& box);

}  // namespace cdprcal
