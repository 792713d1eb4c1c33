// Static workspace (paper appendix A): where the platform can hang in balance, within the tension
// limits (eq. A3) and stably (eq. A4). From six cables on: where the commanded orientation is
// wrench-feasible within the limits.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cdprcal/equilibria/inverse.hpp"
#include "cdprcal/workspace/grid.hpp"

namespace cdprcal {

/// What is known about one grid point. Untested: the flood never reached its neighbourhood, so it
/// is outside any part of the workspace that a seed belongs to.
enum class PointStatus : std::uint8_t {
  untested,
  inside,
  infeasible,      ///< in balance only beyond the tension limits
  unstable,        ///< in balance, not stable
  no_equilibrium,  ///< no orientation in balance was reached, or the geometry is invalid there
  obstructed       ///< inside, were there nothing in the way (the robot file's surroundings)
};

const char* to_string(PointStatus status);

struct WorkspaceProgress {
  std::int64_t tested = 0;
  std::int64_t inside = 0;
  std::int64_t total = 0;  ///< all points of the grid: an upper bound of `tested`
};

struct WorkspaceOptions {
  std::optional<Box> box;  ///< default: workspace_box(robot)
  double step_m = 0.05;
  InverseOptions inverse;
  std::vector<Vector3> seeds_m;  ///< default: a lattice of at most 5×5×5 points in the box
  int threads = 0;               ///< 0: one a core
  /// Halvings of the step with which the boundary is located between a point inside and its
  /// neighbour outside (or the box's face); 0: none.
  int boundary_halvings = 5;
  /// Called from the calling thread, after every level of the flood or 32768 points; false stops
  /// and leaves a usable partial result, flagged as not complete.
  std::function<bool(const WorkspaceProgress&)> progress;
};

struct Workspace {
  Robot robot;
  InverseOptions inverse;
  Grid grid;
  bool complete = false;            ///< false: stopped by `progress`
  std::vector<PointStatus> status;  ///< a grid point, by Grid::index
  std::int64_t points_tested = 0;
  std::vector<std::int32_t> solution;  ///< a grid point: row in the arrays below, −1 when outside
  std::vector<std::int64_t> inside;    ///< grid index of each row
  std::vector<Eigen::Quaterniond> rotation;  ///< equilibrium orientation, a row
  std::vector<double> tension_N;             ///< n values a row
  std::vector<Vector3> boundary_m;  ///< points inside, within step/2^halvings of the boundary

  [[nodiscard]] Vector3 position_m(std::size_t row) const {
    return grid.position_m(grid.coordinates(inside[row]));
  }
  [[nodiscard]] std::int64_t points_inside() const {
    return static_cast<std::int64_t>(inside.size());
  }
  /// All points inside, grid and boundary: what the alpha shape is drawn around.
  [[nodiscard]] std::vector<Vector3> points_m() const;
};

/// Floods outward from the seeds, each point warm-started from a solved neighbour. The result does
/// not depend on the number of threads. An empty workspace is a result (points_inside = 0), with
/// the seeds' statuses telling why. The geometry and inertia of the effects that the robot lists
/// for every run are applied; Workspace::robot has them and an empty list. Throws InputError for a
/// bad box, step, seed outside the box, or a robot for which the inverse problem is not defined.
Workspace compute_workspace(const Robot& given, const WorkspaceOptions& options = {});

/// Why nothing is inside, from what was tested: one sentence. Empty when something is.
std::string explain_empty(const Workspace& workspace);

/// Everything about one position: continued from the solved grid points around it, from nothing
/// when there are none. `margin_N` is the margin to the tension limits.
InverseResult probe(const Workspace& workspace, const Vector3& position_m);

/// Whether the cell of the grid around a position has all its corners inside: conservative.
bool in_solid_cell(const Workspace& workspace, const Vector3& position_m);

}  // namespace cdprcal
