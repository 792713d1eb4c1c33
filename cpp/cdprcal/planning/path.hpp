// The way between two set-points: where the platform goes while the tensions change, and whether it
// may (what paper footnote 2 leaves to luck).
//
// Every tension follows the same fifth-degree polynomial, so the tensions run along the straight
// line between the set-points whatever the duration, and the quasi-static path depends on the line
// alone: at each fraction of it the platform rests in the equilibrium that continues the one
// before. Six cables and more lead the pose itself, by their lengths: see
// equilibria/held_motion.hpp.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cdprcal/planning/set_point.hpp"
#include "cdprcal/workspace/grid.hpp"

namespace cdprcal {

enum class PathStatus {
  clear,
  unstable,               ///< the equilibrium loses its stability at constant tensions, or ends
  other_equilibrium,      ///< it ends in another equilibrium of the same tensions
  beyond_tension_limits,  ///< a tension comes closer to its limits than the margin
  outside_workspace       ///< the platform leaves the bounds or the static workspace
};

const char* to_string(PathStatus status);

struct PathOptions {
  double tension_margin_N = 0.0;  ///< least distance of every tension from the robot's limits
  std::optional<Box> bounds;      ///< of P; default: workspace_box(robot)
};

/// One equilibrium on the way.
struct PathPoint {
  double fraction = 0.0;  ///< of the change of tensions, or of the pose: 0 … 1
  Pose pose;
  CableVector tension_N;
  Vector6 twist_by_fraction;         ///< dζ/ds [m, rad], world axes
  CableVector length_by_fraction_m;  ///< dl/ds
  double stiffness_N_m = 0.0;        ///< Stability::constant_tensions_N_m
};

/// What happens between two set-points.
struct Path {
  PathStatus status = PathStatus::clear;
  std::string reason;             ///< one sentence for people; empty when clear
  std::vector<PathPoint> points;  ///< by rising fraction; up to the failure when not clear

  [[nodiscard]] bool clear() const { return status == PathStatus::clear; }
};

/// The same way back: clear exactly when the way there is.
Path reversed(const Path& path);

/// Follows paths of one robot. `solver` must outlive the checker.
class PathChecker {
 public:
  /// Throws InputError for a margin that is negative or bounds that cannot be (check_box).
  explicit PathChecker(const SetPointSolver& solver, const PathOptions& options = {});

  /// Continues the equilibrium by Newton steps from one set-point to the other. Steps are short
  /// enough that the prediction is good and the stiffness never drops by more than half between
  /// points, so no loss of stability is stepped over. From six cables on along the HeldMotion,
  /// which must be wrench-feasible all the way. Stops at the first point that is not allowed.
  [[nodiscard]] Path follow(const SetPoint& from, const SetPoint& to) const;

  /// Whether the platform may be at a position: within the bounds and the static workspace.
  [[nodiscard]] bool allows(const Vector3& position_m, const Eigen::Quaterniond& rotation) const;

  [[nodiscard]] const Robot& robot() const { return solver_.robot(); }
  [[nodiscard]] const SetPointSolver& solver() const { return solver_; }

 private:
  [[nodiscard]] bool settle(const CableVector& tension_N, Pose& pose) const;
  [[nodiscard]] PathPoint describe(double fraction, const Pose& pose, const CableVector& tension_N,
                                   const CableVector& change_N) const;
  [[nodiscard]] bool is_clear_between(const Pose& from, const Pose& to) const;
  [[nodiscard]] bool accept(const PathPoint& point, Path& path) const;
  [[nodiscard]] Path follow_held(const SetPoint& from, const SetPoint& to) const;

  const SetPointSolver& solver_;
  PathOptions options_;
  Box bounds_;
  double length_scale_m_;
  double step_limit_m_;
};

}  // namespace cdprcal
