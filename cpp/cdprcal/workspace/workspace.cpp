#include "cdprcal/workspace/workspace.hpp"

#include <algorithm>
#include <utility>

#include "cdprcal/effects/applied.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/text.hpp"
#include "cdprcal/workspace/flood.hpp"

namespace cdprcal {
namespace {

/// Grid indices of the seeds, sorted, each once.
std::vector<std::int64_t> seed_points(const Grid& grid, const std::vector<Vector3>& seeds_m) {
  std::vector<std::int64_t> seeds;
  for (const Vector3& seed : seeds_m) {
    if (!seed.allFinite() || !grid.box.contains(seed, 1e-9)) {
      throw InputError("workspace seeds_m: seeds must be in the box");
    }
    seeds.push_back(grid.index(grid.nearest(seed)));
  }
  if (seeds_m.empty()) {  // cell centres of a 5×5×5 division: away from the box's faces
    const Vector3 extent = grid.box.upper_m - grid.box.lower_m;
    for (int k = 0; k < 125; ++k) {
      const Eigen::Vector3i cell(k % 5, k / 5 % 5, k / 25);
      const Vector3 fraction = (cell.cast<double>().array() + 0.5) / 5.0;
      const Vector3 seed = grid.box.lower_m + fraction.cwiseProduct(extent);
      seeds.push_back(grid.index(grid.nearest(seed)));
    }
  }
  std::sort(seeds.begin(), seeds.end());
  seeds.erase(std::unique(seeds.begin(), seeds.end()), seeds.end());
  return seeds;
}

/// The equilibrium at a position, continued from a solved row along a straight line.
InverseSolver::Point follow(const InverseSolver& solver, const Workspace& workspace,
                            std::int32_t row, const Vector3& position_m, int pieces) {
  const Vector3 start = workspace.position_m(row);
  InverseSolver::Point point;
  point.rotation = workspace.rotation[row];
  for (int piece = 1; piece <= pieces; ++piece) {
    const double fraction = static_cast<double>(piece) / pieces;
    point = solver.continue_from(start + fraction * (position_m - start), point.rotation);
    if (rank(point.status) >= rank(EquilibriumStatus::not_found)) break;
  }
  return point;
}

}  // namespace

std::vector<Vector3> Workspace::points_m() const {
  std::vector<Vector3> points;
  points.reserve(inside.size() + boundary_m.size());
  for (std::size_t row = 0; row < inside.size(); ++row) points.push_back(position_m(row));
  points.insert(points.end(), boundary_m.begin(), boundary_m.end());
  return points;
}

Workspace compute_workspace(const Robot& given, const WorkspaceOptions& options) {
  Robot robot = with_effects(given, resolve_effects(given, ""));
  robot.effects.clear();  // applied
  const InverseSolver solver(robot, options.inverse);
  const Box box = in_plane(robot, options.box.value_or(workspace_box(robot)));
  check_box(robot, box);
  if (options.threads < 0 || options.boundary_halvings < 0 || options.boundary_halvings > 20) {
    throw InputError("workspace: threads must be >= 0 and boundary_halvings in 0 to 20");
  }
  Workspace workspace;
  workspace.robot = std::move(robot);
  workspace.inverse = solver.options();
  workspace.grid = make_grid(box, options.step_m);
  workspace.status.assign(workspace.grid.size(), PointStatus::untested);
  workspace.solution.assign(workspace.grid.size(), -1);
  workspace.complete =
      flood_workspace(solver, options, seed_points(workspace.grid, options.seeds_m), workspace);
  if (workspace.complete && options.boundary_halvings > 0) {
    workspace.complete = refine_boundary(solver, options, workspace);
  }
  return workspace;
}

std::string explain_empty(const Workspace& workspace) {
  if (workspace.points_inside() > 0) return {};
  std::array<std::int64_t, 6> count{};
  for (const PointStatus status : workspace.status) ++count[static_cast<int>(status)];
  const std::int64_t infeasible = count[static_cast<int>(PointStatus::infeasible)];
  const std::int64_t unstable = count[static_cast<int>(PointStatus::unstable)];
  const std::int64_t none = count[static_cast<int>(PointStatus::no_equilibrium)];
  const std::int64_t obstructed = count[static_cast<int>(PointStatus::obstructed)];
  std::string check = "tension_limits_N, the mass and the box";
  if (obstructed > 0) {
    const Surroundings& around = workspace.robot.surroundings;
    std::string in_the_way;
    if (around.has_floor()) add_item(in_the_way, "floor_m");
    if (!around.keep_out.empty()) add_item(in_the_way, "keep_out");
    if (around.limits_length()) add_item(in_the_way, "length_limits_m");
    check = in_the_way + ", then " + check;
  }
  return "no static workspace: of " + std::to_string(workspace.points_tested) + " seeds, " +
         std::to_string(infeasible) + " need tensions outside the limits, " +
         std::to_string(unstable) + " are unstable and " + std::to_string(none) +
         " have no equilibrium" +
         (obstructed > 0 ? ", at " + std::to_string(obstructed) + " something is in the way" : "") +
         "; check " + check;
}

InverseResult probe(const Workspace& workspace, const Vector3& position_m) {
  if (!position_m.allFinite()) throw InputError("position_m: must be finite [m]");
  // Solved points of the 3×3×3 block around the closest one, closest first.
  const Grid& grid = workspace.grid;
  const std::array<int, 3> centre = grid.nearest(position_m);
  std::vector<std::pair<double, std::int32_t>> starts;
  for (int k = 0; k < 27; ++k) {
    const std::array<int, 3> at{centre[0] + k % 3 - 1, centre[1] + k / 3 % 3 - 1,
                                centre[2] + k / 9 - 1};
    bool in_grid = true;
    for (int a = 0; a < 3; ++a) in_grid = in_grid && at[a] >= 0 && at[a] < grid.count[a];
    if (!in_grid) continue;
    const std::int32_t row = workspace.solution[grid.index(at)];
    if (row >= 0) starts.emplace_back((grid.position_m(at) - position_m).squaredNorm(), row);
  }
  std::sort(starts.begin(), starts.end());
  const InverseSolver solver(workspace.robot, workspace.inverse);
  InverseSolver::Point best;
  for (const int pieces : {1, 8}) {  // in one go; else along the line, in short steps
    for (const auto& [distance, row] : starts) {
      const InverseSolver::Point point = follow(solver, workspace, row, position_m, pieces);
      if (rank(point.status) < rank(best.status)) best = point;
      if (best.status == EquilibriumStatus::found) return solver.describe(position_m, best);
    }
    if (rank(best.status) < rank(EquilibriumStatus::not_found)) break;
  }
  if (best.status == EquilibriumStatus::not_found) best = solver.solve(position_m);
  return solver.describe(position_m, best);
}

bool in_solid_cell(const Workspace& workspace, const Vector3& position_m) {
  const Grid& grid = workspace.grid;
  std::array<int, 3> low{};
  for (int a = 0; a < 3; ++a) {
    const double steps = (position_m[a] - grid.origin_m[a]) / grid.step_m;
    if (!(steps >= 0.0 && steps <= grid.count[a] - 1.0)) return false;
    low[a] = std::min(static_cast<int>(steps), std::max(0, grid.count[a] - 2));
  }
  for (int corner = 0; corner < 8; ++corner) {
    std::array<int, 3> at{};
    for (int a = 0; a < 3; ++a) at[a] = std::min(low[a] + (corner >> a & 1), grid.count[a] - 1);
    if (workspace.status[grid.index(at)] != PointStatus::inside) return false;
  }
  return true;
}

const char* to_string(PointStatus status) {
  switch (status) {
    case PointStatus::untested:
      return "untested";
    case PointStatus::inside:
      return "inside";
    case PointStatus::infeasible:
      return "infeasible";
    case PointStatus::unstable:
      return "unstable";
    case PointStatus::no_equilibrium:
      return "no_equilibrium";
    case PointStatus::obstructed:
      return "obstructed";
  }
  return "unknown";
}

}  // namespace cdprcal
