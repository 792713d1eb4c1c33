// NLopt over platform poses: the one place where the optimiser meets SE(3).
#pragma once

#include <functional>
#include <string>

#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/kinematics/platform.hpp"

namespace cdprcal {

/// Everywhere that a suspended platform can be: the box of the pulleys, grown by the platform, and
/// down to ten times the robot's size below them.
Box search_bounds(const Robot& robot);

/// What is minimised. The gradients are along world-frame twists (see geometry/pose.hpp); the
/// search applies the chain rule to its own coordinates.
struct PoseObjective {
  /// Value at a valid state; fills the gradient when it is not null.
  std::function<double(const Pose&, const PlatformState&, Vector6* gradient)> value;
  /// Optional constraints c ≤ 0, and their rows ∂c/∂δ when the pointer is not null.
  std::function<CableVector(const Pose&, const PlatformState&, CableJacobian* rows)> constraint;
  int constraint_count = 0;
};

struct PoseSearchOptions {
  bool fixed_position = false;       ///< only the rotation moves (inverse problem)
  double length_scale_m = 1.0;       ///< a radian counts as this many metres
  double relative_tolerance = 1e-7;  ///< of the coordinates; Newton polishes what comes out
  int max_evaluations = 400;
};

struct PoseSearchResult {
  bool finished = false;  ///< the optimiser stopped by itself at a finite value
  bool at_bound = false;  ///< it ran into the edge of the box: no minimum inside
  Pose pose;              ///< the best pose seen
  double value = 0.0;
  int evaluations = 0;
  std::string message;  ///< of the optimiser, when it did not finish
};

/// Local minimum by NLopt's SLSQP (dense quasi-Newton with bounds and constraints) from `start`.
/// The pose is start ⊕ δ with δ = (δp, δθ); gradients along a twist at the current pose become
/// gradients by δθ through the left Jacobian of exp on SO(3). Positions stay within `bounds`; any
/// rotation up to half a turn from the start.
PoseSearchResult search_pose(const Robot& robot, const Pose& start, const Box& bounds,
                             const PoseObjective& objective, const PoseSearchOptions& options);

}  // namespace cdprcal
