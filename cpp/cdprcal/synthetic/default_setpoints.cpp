// Set-points for synthetic logs: a grid of equilibria that a robot can visit under force control.
#include <array>
#include <optional>

#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/equilibria/inverse.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/synthetic/synthetic.hpp"
#include "cdprcal/workspace/grid.hpp"

namespace cdprcal {
namespace {

using Counts = std::array<int, 3>;

constexpr double kLargestShare = 0.6;  ///< of the box that the platform may be in
constexpr double kSmallestShare = 0.02;
constexpr double kShrink = 0.85;
/// Points of a transition at which the quasi-static path is followed.
constexpr int kPathSteps = 12;
/// The path must end in the pose it was planned for, not in another equilibrium.
constexpr double kSamePose = 1e-6;

/// Grid points in a serpentine: neighbours in the list are neighbours in the grid.
std::vector<Vector3> serpentine(const Box& box, const Counts& counts) {
  const auto at = [&](int axis, int index) {
    const double fraction =
        counts[axis] > 1 ? static_cast<double>(index) / (counts[axis] - 1) : 0.5;
    return box.lower_m[axis] + fraction * (box.upper_m[axis] - box.lower_m[axis]);
  };
  std::vector<Vector3> points;
  int row = 0;
  for (int k = counts[2] - 1; k >= 0; --k) {  // from the top, where the stiffness is largest
    for (int jj = 0; jj < counts[1]; ++jj, ++row) {
      const int j = k % 2 == (counts[2] - 1) % 2 ? jj : counts[1] - 1 - jj;
      for (int ii = 0; ii < counts[0]; ++ii) {
        const int i = row % 2 == 0 ? ii : counts[0] - 1 - ii;
        points.emplace_back(at(0, i), at(1, j), at(2, k));
      }
    }
  }
  return points;
}

/// Whether constant-tension control carries the platform from one equilibrium to the next.
bool reaches(const Robot& robot, const Pose& from, const CableVector& from_N, const Pose& to,
             const CableVector& to_N) {
  Pose pose = from;
  for (int step = 1; step <= kPathSteps; ++step) {
    const double fraction = fifth_degree(static_cast<double>(step) / kPathSteps);
    const EquilibriumResult rest =
        direct_from_tensions(robot, from_N + fraction * (to_N - from_N), pose);
    if (rest.status != EquilibriumStatus::found) return false;
    pose = rest.pose;
  }
  return minus(pose, to).norm() < kSamePose;
}

std::optional<std::vector<CableVector>> visit(const InverseSolver& solver, const Box& box,
                                              const Counts& counts) {
  std::vector<CableVector> setpoints;
  Pose previous;
  for (const Vector3& position_m : serpentine(box, counts)) {
    const InverseSolver::Point point = solver.solve(position_m);
    if (point.status != EquilibriumStatus::found) return std::nullopt;
    const Pose pose{position_m, point.rotation};
    if (!setpoints.empty() &&
        !reaches(solver.robot(), previous, setpoints.back(), pose, point.tension_N)) {
      return std::nullopt;
    }
    setpoints.push_back(point.tension_N);
    previous = pose;
  }
  return setpoints;
}

}  // namespace

std::vector<CableVector> default_setpoints(const Robot& robot, int nx, int ny, int nz) {
  const Counts counts{nx, ny, nz};
  for (const int count : counts) {
    if (count < 1 || count > 99) {
      throw InputError("set-points: a grid has 1 to 99 points in each direction, not " +
                       std::to_string(count));
    }
  }
  InverseOptions options;
  options.stability = StabilityNotion::constant_tensions;
  const InverseSolver solver(robot, options);
  const Box box = workspace_box(robot);
  const Vector3 centre_m = 0.5 * (box.lower_m + box.upper_m);
  const Vector3 half_m = 0.5 * (box.upper_m - box.lower_m);
  for (double share = kLargestShare; share > kSmallestShare; share *= kShrink) {
    const Box smaller{centre_m - share * half_m, centre_m + share * half_m};
    if (const auto setpoints = visit(solver, smaller, counts)) return *setpoints;
  }
  throw InputError("set-points: robot " + robot.name +
                   " has no grid of stable equilibria within its tension limits around the middle "
                   "of its frame; give set-points of your own");
}

}  // namespace cdprcal
