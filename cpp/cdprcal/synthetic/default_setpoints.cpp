// Set-points for synthetic logs: a grid of equilibria that a robot can visit.
#include <array>
#include <optional>

#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/equilibria/held_motion.hpp"
#include "cdprcal/equilibria/inverse.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/kinematics/motion.hpp"
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

/// Whether constant-tension control carries the platform from one equilibrium to the next; or, from
/// six cables on, lengths do, with every cable taut.
bool reaches(const Robot& robot, const Pose& from, const CableVector& from_N, const Pose& to,
             const CableVector& to_N) {
  if (holds_orientation(robot)) {
    const HeldMotion motion(from, from_N, to, to_N);
    for (int step = 0; step <= kPathSteps; ++step) {
      const HeldPoint at = held_point(robot, motion, static_cast<double>(step) / kPathSteps);
      if (at.tension_N.size() == 0 || !(tension_margin_N(robot, at.tension_N) >= -1e-9))
        return false;
    }
    return true;
  }
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

std::optional<std::vector<SyntheticStop>> visit(const InverseSolver& solver, const Box& box,
                                                const Counts& counts) {
  std::vector<SyntheticStop> stops;
  for (const Vector3& inside_m : serpentine(box, counts)) {
    const Vector3 position_m =
        on_motion(solver.robot(), {inside_m, Eigen::Quaterniond::Identity()}).position_m;
    const InverseSolver::Point point = solver.solve(position_m);
    if (point.status != EquilibriumStatus::found) return std::nullopt;
    const Pose pose{position_m, point.rotation};
    if (!stops.empty() && !reaches(solver.robot(), stops.back().pose, stops.back().tension_N, pose,
                                   point.tension_N)) {
      return std::nullopt;
    }
    stops.push_back({pose, point.tension_N});
  }
  return stops;
}

}  // namespace

std::vector<SyntheticStop> default_stops(const Robot& robot, int nx, int ny, int nz) {
  Counts counts{nx, ny, nz};
  for (const int count : counts) {
    if (count < 1 || count > 99) {
      throw InputError("set-points: a grid has 1 to 99 points in each direction, not " +
                       std::to_string(count));
    }
  }
  counts = in_plane(robot, counts);
  InverseOptions options;
  if (!holds_orientation(robot)) options.stability = StabilityNotion::constant_tensions;
  const InverseSolver solver(robot, options);
  const Box box = workspace_box(robot);
  const Vector3 centre_m = 0.5 * (box.lower_m + box.upper_m);
  const Vector3 half_m = 0.5 * (box.upper_m - box.lower_m);
  for (double share = kLargestShare; share > kSmallestShare; share *= kShrink) {
    const Box smaller{centre_m - share * half_m, centre_m + share * half_m};
    if (const auto stops = visit(solver, smaller, counts)) return *stops;
  }
  throw InputError("set-points: robot " + robot.name +
                   " has no grid of stable equilibria within its tension limits around the middle "
                   "of its frame; let cdprcal plan find places, and give its file with --plan");
}

std::vector<CableVector> default_setpoints(const Robot& robot, int nx, int ny, int nz) {
  std::vector<CableVector> setpoints;
  for (const SyntheticStop& stop : default_stops(robot, nx, ny, nz)) {
    setpoints.push_back(stop.tension_N);
  }
  return setpoints;
}

}  // namespace cdprcal
