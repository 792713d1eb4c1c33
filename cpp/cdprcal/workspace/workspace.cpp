#include "cdprcal/workspace/workspace.hpp"

#include <algorithm>
#include <thread>
#include <utility>

#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

constexpr std::array<std::array<int, 3>, 6> kNeighbours{
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};
/// Times a point may be tried again, each from another neighbour, when no equilibrium was reached.
constexpr int kAttempts = 3;
/// A thread is worth starting for this many points.
constexpr std::size_t kPointsPerThread = 64;
constexpr std::size_t kBatch = 1 << 15;  ///< points between two calls of `progress`

/// Runs body(k) for k in [0, count), in contiguous parts. Bodies write only to their own element.
template <typename Body>
void parallel_for(std::size_t count, int threads, const Body& body) {
  const std::size_t parts =
      std::clamp<std::size_t>(count / kPointsPerThread, 1, static_cast<std::size_t>(threads));
  const auto run = [&](std::size_t part) {
    for (std::size_t k = count * part / parts; k < count * (part + 1) / parts; ++k) body(k);
  };
  std::vector<std::thread> workers;
  for (std::size_t part = 1; part < parts; ++part) workers.emplace_back(run, part);
  run(0);
  for (std::thread& worker : workers) worker.join();
}

PointStatus point_status(EquilibriumStatus status) {
  switch (status) {
    case EquilibriumStatus::found: return PointStatus::inside;
    case EquilibriumStatus::infeasible: return PointStatus::infeasible;
    case EquilibriumStatus::unstable: return PointStatus::unstable;
    default: return PointStatus::no_equilibrium;
  }
}

/// A point to test and the solved row it starts from (−1: a seed, from nothing).
struct Candidate {
  std::int64_t point = 0;
  std::int32_t from = -1;
};

class Flood {
 public:
  Flood(const InverseSolver& solver, const WorkspaceOptions& options, Workspace& workspace)
      : solver_(solver), options_(options), w_(workspace) {
    threads_ = options.threads > 0
                   ? options.threads
                   : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    attempts_.assign(w_.status.size(), 0);
  }

  /// Level by level, so that what a point starts from never depends on timing.
  bool run(const std::vector<std::int64_t>& seeds) {
    std::vector<Candidate> level;
    for (const std::int64_t seed : seeds) level.push_back({seed, -1});
    while (!level.empty()) {
      const std::size_t before = w_.inside.size();
      for (std::size_t begin = 0; begin < level.size(); begin += kBatch) {
        test(level, begin, std::min(begin + kBatch, level.size()));
        if (!report()) return false;
      }
      level = neighbours_of_rows(before);
    }
    return true;
  }

  /// Bisection along the grid's edges between points inside and whatever is not.
  bool refine_boundary() {
    struct Edge {
      std::int32_t row;
      int neighbour;
    };
    std::vector<Edge> edges;
    for (std::size_t row = 0; row < w_.inside.size(); ++row) {
      const std::array<int, 3> ijk = w_.grid.coordinates(w_.inside[row]);
      for (int k = 0; k < 6; ++k) {
        const std::array<int, 3> next = neighbour(ijk, k);
        if (!in_grid(next) || w_.status[w_.grid.index(next)] != PointStatus::inside) {
          edges.push_back({static_cast<std::int32_t>(row), k});
        }
      }
    }
    std::vector<double> reach(edges.size());
    const auto position = [&](const Edge& edge, double fraction) -> Vector3 {
      const auto& d = kNeighbours[edge.neighbour];
      return w_.position_m(edge.row) + fraction * w_.grid.step_m * Vector3(d[0], d[1], d[2]);
    };
    for (std::size_t begin = 0; begin < edges.size(); begin += kBatch) {
      parallel_for(std::min(kBatch, edges.size() - begin), threads_, [&](std::size_t k) {
        const Edge& edge = edges[begin + k];
        Eigen::Quaterniond rotation = w_.rotation[edge.row];
        const auto inside = [&](double fraction) {
          const InverseSolver::Point point =
              solver_.continue_from(position(edge, fraction), rotation);
          if (point.status == EquilibriumStatus::found) rotation = point.rotation;
          return point.status == EquilibriumStatus::found;
        };
        // The box cuts the edge when the neighbour is beyond its face.
        const int axis = edge.neighbour / 2;
        const Vector3 start = w_.position_m(edge.row);
        const double room = edge.neighbour % 2 == 0 ? start[axis] - w_.grid.box.lower_m[axis]
                                                    : w_.grid.box.upper_m[axis] - start[axis];
        double low = 0.0;
        double high = std::clamp(room / w_.grid.step_m, 0.0, 1.0);
        if (high < 1.0 && high > 0.0 && inside(high)) low = high;
        for (int halving = 0; halving < options_.boundary_halvings && low < high; ++halving) {
          const double middle = 0.5 * (low + high);
          (inside(middle) ? low : high) = middle;
        }
        reach[begin + k] = low;
      });
      if (!report()) return false;
    }
    for (std::size_t k = 0; k < edges.size(); ++k) {
      if (reach[k] > 1e-9) w_.boundary_m.push_back(position(edges[k], reach[k]));
    }
    return true;
  }

 private:
  static std::array<int, 3> neighbour(const std::array<int, 3>& ijk, int k) {
    return {ijk[0] + kNeighbours[k][0], ijk[1] + kNeighbours[k][1], ijk[2] + kNeighbours[k][2]};
  }

  [[nodiscard]] bool in_grid(const std::array<int, 3>& ijk) const {
    for (int a = 0; a < 3; ++a) {
      if (ijk[a] < 0 || ijk[a] >= w_.grid.count[a]) return false;
    }
    return true;
  }

  void test(const std::vector<Candidate>& level, std::size_t begin, std::size_t end) {
    results_.resize(end - begin);
    parallel_for(end - begin, threads_, [&](std::size_t k) {
      const Candidate& candidate = level[begin + k];
      const Vector3 position = w_.grid.position_m(w_.grid.coordinates(candidate.point));
      if (candidate.from < 0) {
        results_[k] = solver_.solve(position);
        return;
      }
      const Eigen::Quaterniond& start = w_.rotation[candidate.from];
      results_[k] = solver_.continue_from(position, start);
      if (results_[k].status == EquilibriumStatus::not_found) {
        results_[k] = solver_.search_from(position, start);
      }
    });
    for (std::size_t k = 0; k < results_.size(); ++k) {
      const std::int64_t index = level[begin + k].point;
      if (attempts_[index]++ == 0) ++w_.points_tested;
      w_.status[index] = point_status(results_[k].status);
      if (w_.status[index] != PointStatus::inside) continue;
      w_.solution[index] = static_cast<std::int32_t>(w_.inside.size());
      w_.inside.push_back(index);
      w_.rotation.push_back(results_[k].rotation);
      const CableVector& tension = results_[k].tension_N;
      w_.tension_N.insert(w_.tension_N.end(), tension.data(), tension.data() + tension.size());
      ++w_.points_inside;
    }
  }

  std::vector<Candidate> neighbours_of_rows(std::size_t first_row) {
    std::vector<Candidate> next;
    for (std::size_t row = first_row; row < w_.inside.size(); ++row) {
      const std::array<int, 3> ijk = w_.grid.coordinates(w_.inside[row]);
      for (int k = 0; k < 6; ++k) {
        const std::array<int, 3> at = neighbour(ijk, k);
        if (!in_grid(at)) continue;
        const std::int64_t index = w_.grid.index(at);
        const PointStatus status = w_.status[index];
        const bool again =
            status == PointStatus::no_equilibrium && attempts_[index] < kAttempts;
        if (status != PointStatus::untested && !again) continue;
        next.push_back({index, static_cast<std::int32_t>(row)});
      }
    }
    // Each point once, from its first neighbour in order.
    std::stable_sort(next.begin(), next.end(),
                     [](const Candidate& a, const Candidate& b) { return a.point < b.point; });
    next.erase(std::unique(next.begin(), next.end(),
                           [](const Candidate& a, const Candidate& b) {
                             return a.point == b.point;
                           }),
               next.end());
    return next;
  }

  bool report() const {
    if (!options_.progress) return true;
    return options_.progress({w_.points_tested, w_.points_inside, w_.grid.size()});
  }

  const InverseSolver& solver_;
  const WorkspaceOptions& options_;
  Workspace& w_;
  int threads_ = 1;
  std::vector<std::uint8_t> attempts_;
  std::vector<InverseSolver::Point> results_;
};

/// Grid indices of the seeds, sorted, each once.
std::vector<std::int64_t> seed_points(const Grid& grid, const std::vector<Vector3>& seeds_m) {
  std::vector<std::int64_t> seeds;
  for (const Vector3& seed : seeds_m) {
    if (!seed.allFinite() || !grid.box.contains(seed, 1e-9)) {
      throw InputError("workspace seeds_m: a seed is outside the box");
    }
    seeds.push_back(grid.index(grid.nearest(seed)));
  }
  if (seeds_m.empty()) {  // cell centres of a 5×5×5 division: away from the box's faces
    const Vector3 extent = grid.box.upper_m - grid.box.lower_m;
    for (int k = 0; k < 125; ++k) {
      const Vector3 fraction((k % 5 + 0.5) / 5.0, (k / 5 % 5 + 0.5) / 5.0, (k / 25 + 0.5) / 5.0);
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

CableVector Workspace::tension_at_N(std::size_t row) const {
  const int n = robot.cable_count();
  return Eigen::Map<const Eigen::VectorXd>(tension_N.data() + row * n, n);
}

std::vector<Vector3> Workspace::points_m() const {
  std::vector<Vector3> points;
  points.reserve(inside.size() + boundary_m.size());
  for (std::size_t row = 0; row < inside.size(); ++row) points.push_back(position_m(row));
  points.insert(points.end(), boundary_m.begin(), boundary_m.end());
  return points;
}

Workspace compute_workspace(const Robot& robot, const WorkspaceOptions& options) {
  const InverseSolver solver(robot, options.inverse);
  const Box box = options.box.value_or(workspace_box(robot));
  check_box(robot, box);
  if (options.threads < 0 || options.boundary_halvings < 0 || options.boundary_halvings > 20) {
    throw InputError("workspace: threads must be >= 0 and boundary_halvings in 0 to 20");
  }
  Workspace workspace;
  workspace.robot = robot;
  workspace.inverse = options.inverse;
  workspace.grid = make_grid(box, options.step_m);
  workspace.status.assign(workspace.grid.size(), PointStatus::untested);
  workspace.solution.assign(workspace.grid.size(), -1);
  Flood flood(solver, options, workspace);
  workspace.complete = flood.run(seed_points(workspace.grid, options.seeds_m));
  if (workspace.complete && options.boundary_halvings > 0) {
    workspace.complete = flood.refine_boundary();
  }
  return workspace;
}

std::string explain_empty(const Workspace& workspace) {
  if (workspace.points_inside > 0) return {};
  std::array<std::int64_t, 5> count{};
  for (const PointStatus status : workspace.status) ++count[static_cast<int>(status)];
  const std::int64_t infeasible = count[static_cast<int>(PointStatus::infeasible)];
  const std::int64_t unstable = count[static_cast<int>(PointStatus::unstable)];
  const std::int64_t none = count[static_cast<int>(PointStatus::no_equilibrium)];
  return "no static workspace: of " + std::to_string(workspace.points_tested) +
         " seeds, " + std::to_string(infeasible) + " need tensions outside the limits, " +
         std::to_string(unstable) + " are unstable and " + std::to_string(none) +
         " have no equilibrium; check tension_limits_N, the mass and the box";
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
    case PointStatus::untested: return "untested";
    case PointStatus::inside: return "inside";
    case PointStatus::infeasible: return "infeasible";
    case PointStatus::unstable: return "unstable";
    case PointStatus::no_equilibrium: return "no_equilibrium";
  }
  return "unknown";
}

}  // namespace cdprcal
