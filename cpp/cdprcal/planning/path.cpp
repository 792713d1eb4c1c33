#include "cdprcal/planning/path.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/equilibria/held_motion.hpp"
#include "cdprcal/equilibria/starts.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/kinematics/obstruction.hpp"
#include "cdprcal/planning/pose_grid.hpp"
#include "cdprcal/statics/tension.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

constexpr double kMostTurn_rad = 0.1;      ///< between two points
constexpr double kMoveShare = 1.0 / 40.0;  ///< of the robot's size, between two points
constexpr double kLeastStep = 1e-5;        ///< of the fraction: below, the equilibrium is lost
constexpr int kNewtonSteps = 12;
constexpr double kBalance = 1e-10;  ///< error ÷ weight, as in DirectOptions
/// Error ÷ weight that tensions of a plan may have where lengths hold the pose: far below what a
/// load cell tells, far above what a file rounds.
constexpr double kHeldBalance = 1e-3;

/// Size of a twist in steps that are still short.
double size_of(const Vector6& twist, double step_limit_m) {
  return std::max(twist.head<3>().norm() / step_limit_m, twist.tail<3>().norm() / kMostTurn_rad);
}

void fail(Path& path, PathStatus status, const PathPoint& at, const std::string& why) {
  path.status = status;
  path.reason = printed("at %.3g %% of the way, near ", 100.0 * at.fraction) +
                in_words(at.pose.position_m) + " " + why;
}

}  // namespace

const char* to_string(PathStatus status) {
  switch (status) {
    case PathStatus::clear:
      return "clear";
    case PathStatus::unstable:
      return "unstable";
    case PathStatus::other_equilibrium:
      return "other_equilibrium";
    case PathStatus::beyond_tension_limits:
      return "beyond_tension_limits";
    case PathStatus::outside_workspace:
      return "outside_workspace";
  }
  return "unknown";
}

Path reversed(const Path& path) {
  Path back = path;
  std::reverse(back.points.begin(), back.points.end());
  for (PathPoint& point : back.points) {
    point.fraction = 1.0 - point.fraction;
    point.twist_by_fraction = -point.twist_by_fraction;
    point.length_by_fraction_m = -point.length_by_fraction_m;
  }
  return back;
}

PathChecker::PathChecker(const SetPointSolver& solver, const PathOptions& options)
    : solver_(solver),
      options_(options),
      bounds_(in_plane(solver.robot(), options.bounds.value_or(workspace_box(solver.robot())))),
      length_scale_m_(characteristic_length_m(solver.robot())),
      step_limit_m_(kMoveShare * robot_size_m(solver.robot())) {
  if (!(options.tension_margin_N >= 0.0)) throw InputError("path: the margin must be at least 0 N");
  if (options.bounds) check_box(solver.robot(), bounds_);
}

bool PathChecker::allows(const Vector3& position_m, const Eigen::Quaterniond& rotation) const {
  // The bounds are where a set-point may be; rounding must not throw out one on their face.
  return bounds_.contains(position_m, 1e-9) && solver_.in_workspace(position_m, rotation);
}

/// Newton on Ξᵀτ = f (eq. 6) from a pose that is close; false when it does not settle.
bool PathChecker::settle(const CableVector& tension_N, Pose& pose) const {
  const double tolerance = kBalance * solver_.robot().weight_N();
  for (int step = 0; step < kNewtonSteps; ++step) {
    const PlatformState state = platform_state(solver_.robot(), pose);
    if (!state.valid) return false;
    const Vector6 residual = wrench_residual(solver_.robot(), state, tension_N);
    if (balance_error_N(residual, length_scale_m_) <= tolerance) return true;
    const Vector6 twist = -solve_square(stiffness(solver_.robot(), state, tension_N), residual);
    if (!twist.allFinite() || size_of(twist, step_limit_m_) > 1.0) return false;
    pose = plus(pose, twist);
  }
  return false;
}

PathPoint PathChecker::describe(double fraction, const Pose& pose, const CableVector& tension_N,
                                const CableVector& change_N) const {
  const Robot& robot = solver_.robot();
  const PlatformState state = platform_state(robot, pose);
  PathPoint point{fraction, pose, tension_N, Vector6::Zero(), CableVector(), 0.0};
  const WrenchMatrix structure = structure_matrix(state);
  // Ξᵀτ = f at every s: (K + Q) dζ/ds = −Ξᵀ dτ/ds
  point.twist_by_fraction =
      -solve_square(stiffness(robot, state, tension_N), Vector6(structure * change_N));
  point.length_by_fraction_m = structure.transpose() * point.twist_by_fraction;
  point.stiffness_N_m = stability(robot, state, tension_N).constant_tensions_N_m;
  return point;
}

/// Whether nothing stands between two points of a way, however thin it is: no cable or anchor moves
/// over half of the thinnest box from one look to the next.
bool PathChecker::is_clear_between(const Pose& from, const Pose& to) const {
  constexpr double kThinnest_m = 1e-3;
  const Robot& robot = solver_.robot();
  const std::vector<Box>& boxes = robot.surroundings.keep_out;
  if (boxes.empty()) return true;
  double thinnest_m = std::numeric_limits<double>::infinity();
  for (const Box& box : boxes) {
    thinnest_m = std::min(thinnest_m, (box.upper_m - box.lower_m).minCoeff());
  }
  const Vector6 twist = minus(to, from);
  const double moved_m = twist.head<3>().norm() + length_scale_m_ * twist.tail<3>().norm();
  const int looks =
      static_cast<int>(std::ceil(moved_m / (0.5 * std::max(thinnest_m, kThinnest_m))));
  for (int k = 1; k < looks; ++k) {
    const Pose between = plus(from, static_cast<double>(k) / looks * twist);
    if (!is_clear(robot, between, platform_state(robot, between))) return false;
  }
  return true;
}

/// Adds a point, or says in `path` why it may not be there.
bool PathChecker::accept(const PathPoint& point, Path& path) const {
  if (!holds_orientation(solver_.robot()) && !(point.stiffness_N_m > 0.0)) {
    fail(path, PathStatus::unstable, point, "the platform is no longer stable");
  } else if (tension_margin_N(solver_.robot(), point.tension_N) <
             options_.tension_margin_N - 1e-9 * solver_.robot().tension_max_N) {
    fail(path, PathStatus::beyond_tension_limits, point,
         "a tension comes too close to the robot's limits");
  } else if (!bounds_.contains(point.pose.position_m, 1e-9)) {
    fail(path, PathStatus::outside_workspace, point, "the platform leaves its bounds");
  } else if (!solver_.in_workspace(point.pose.position_m, point.pose.rotation)) {
    fail(path, PathStatus::outside_workspace, point,
         is_clear(solver_.robot(), point.pose, platform_state(solver_.robot(), point.pose))
             ? "the platform leaves the static workspace"
             : "something is in the way");
  } else if (!path.points.empty() && !is_clear_between(path.points.back().pose, point.pose)) {
    fail(path, PathStatus::outside_workspace, point, "something is in the way");
  }
  path.points.push_back(point);
  return path.clear();
}

/// Lengths lead the pose: every point of the way must be one where the cables hold it.
Path PathChecker::follow_held(const SetPoint& from, const SetPoint& to) const {
  Path path;
  const Robot& robot = solver_.robot();
  const HeldMotion motion(from.pose, from.tension_N, to.pose, to.tension_N);
  const int steps = std::max(1, static_cast<int>(std::ceil(size_of(motion.twist, step_limit_m_))));
  for (int k = 0; k <= steps; ++k) {
    const double fraction = static_cast<double>(k) / steps;
    const HeldPoint held = held_point(robot, motion, fraction);
    PathPoint point{fraction, held.pose, held.tension_N, motion.twist, CableVector(), 0.0};
    if (held.tension_N.size() == 0) {
      fail(path, PathStatus::outside_workspace, point, "the cables do not hold the platform");
      return path;
    }
    point.length_by_fraction_m = length_jacobian(held.state) * motion.twist;
    point.stiffness_N_m = stability(robot, held.state, held.tension_N).constant_tensions_N_m;
    if (!accept(point, path)) return path;
    const CableVector& end_N = k == 0 ? from.tension_N : to.tension_N;
    if ((k == 0 || k == steps) &&
        (held.tension_N - end_N).norm() > kHeldBalance * robot.weight_N()) {
      fail(path, PathStatus::unstable, point, "the tensions do not hold the platform");
      return path;
    }
  }
  return path;
}

Path PathChecker::follow(const SetPoint& from, const SetPoint& to) const {
  if (holds_orientation(solver_.robot())) return follow_held(from, to);
  Path path;
  const CableVector change_N = to.tension_N - from.tension_N;
  Pose start = from.pose;
  if (!settle(from.tension_N, start)) {
    path.status = PathStatus::unstable;
    path.reason = "the path's first set-point is no equilibrium";
    return path;
  }
  if (!accept(describe(0.0, start, from.tension_N, change_N), path)) return path;
  double step = 1.0;
  while (path.points.back().fraction < 1.0) {
    const PathPoint& at = path.points.back();
    const double speed = size_of(at.twist_by_fraction, step_limit_m_);
    step = std::min({step, 1.0 - at.fraction, speed > 0.0 ? 1.0 / speed : 1.0});
    if (!(step >= kLeastStep)) {  // also when the speed is not finite
      fail(path, PathStatus::unstable, at, "the equilibrium ends: the platform would jump");
      return path;
    }
    const double fraction = step >= 1.0 - at.fraction - 1e-12 ? 1.0 : at.fraction + step;
    const CableVector tension_N = from.tension_N + fraction * change_N;
    const Vector6 move = (fraction - at.fraction) * at.twist_by_fraction;
    const Pose predicted = plus(at.pose, move);
    Pose pose = predicted;
    // The prediction must be good to a tenth of a step, or this may be another equilibrium.
    const bool settled =
        settle(tension_N, pose) && size_of(minus(pose, predicted), step_limit_m_) < 0.1;
    const PathPoint next = settled ? describe(fraction, pose, tension_N, change_N) : PathPoint{};
    if (!settled || !(next.stiffness_N_m > 0.5 * at.stiffness_N_m)) {
      if (step < 2.0 * kLeastStep && settled) {  // stiffness halved within the shortest step
        fail(path, PathStatus::unstable, next, "the platform loses its stability");
        return path;
      }
      step *= 0.5;
      continue;
    }
    if (!accept(next, path)) return path;
    step *= 2.0;
  }
  const PathPoint& end = path.points.back();
  if (size_of(minus(end.pose, to.pose), step_limit_m_) > 1e-3) {
    fail(path, PathStatus::other_equilibrium, end,
         "the platform arrives in another equilibrium of the same tensions");
  }
  return path;
}

}  // namespace cdprcal
