#include "cdprcal/workspace/flood.hpp"

#include <algorithm>
#include <array>

#include "cdprcal/parallel.hpp"

namespace cdprcal {
namespace {

constexpr std::array<std::array<int, 3>, 6> kNeighbours{
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};
/// Times a point may be tried again, each from another neighbour, when no equilibrium was reached.
constexpr int kAttempts = 3;
constexpr std::size_t kPointsAtOnce = 64;  ///< that a thread takes
constexpr std::size_t kBatch = 1 << 15;    ///< points between two calls of `progress`

PointStatus point_status(EquilibriumStatus status) {
  switch (status) {
    case EquilibriumStatus::found:
      return PointStatus::inside;
    case EquilibriumStatus::obstructed:
      return PointStatus::obstructed;
    case EquilibriumStatus::infeasible:
      return PointStatus::infeasible;
    case EquilibriumStatus::unstable:
      return PointStatus::unstable;
    default:
      return PointStatus::no_equilibrium;
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
      : solver_(solver), options_(options), w_(workspace) {}

  /// Level by level, so that what a point starts from never depends on timing.
  bool run(const std::vector<std::int64_t>& seeds) {
    std::vector<Candidate> level;
    attempts_.assign(w_.status.size(), 0);
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
      for_all(std::min(kBatch, edges.size() - begin), [&](std::size_t k) {
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
  /// Calls body(k) for k in [0, count); bodies write only to their own element.
  template <typename Body>
  void for_all(std::size_t count, const Body& body) const {
    parallel_for(count, {.threads = options_.threads, .grain = kPointsAtOnce}, body);
  }

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
    for_all(end - begin, [&](std::size_t k) {
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
        const bool again = status == PointStatus::no_equilibrium && attempts_[index] < kAttempts;
        if (status != PointStatus::untested && !again) continue;
        next.push_back({index, static_cast<std::int32_t>(row)});
      }
    }
    // Each point once, from its first neighbour in order.
    std::stable_sort(next.begin(), next.end(),
                     [](const Candidate& a, const Candidate& b) { return a.point < b.point; });
    next.erase(
        std::unique(next.begin(), next.end(),
                    [](const Candidate& a, const Candidate& b) { return a.point == b.point; }),
        next.end());
    return next;
  }

  bool report() const {
    if (!options_.progress) return true;
    return options_.progress({w_.points_tested, w_.points_inside(), w_.grid.size()});
  }

  const InverseSolver& solver_;
  const WorkspaceOptions& options_;
  Workspace& w_;
  std::vector<std::uint8_t> attempts_;
  std::vector<InverseSolver::Point> results_;
};

}  // namespace

bool flood_workspace(const InverseSolver& solver, const WorkspaceOptions& options,
                     const std::vector<std::int64_t>& seeds, Workspace& workspace) {
  return Flood(solver, options, workspace).run(seeds);
}

bool refine_boundary(const InverseSolver& solver, const WorkspaceOptions& options,
                     Workspace& workspace) {
  return Flood(solver, options, workspace).refine_boundary();
}

}  // namespace cdprcal
