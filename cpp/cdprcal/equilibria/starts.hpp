// Where to start looking for an equilibrium when nobody gave a pose: from the geometry alone.
#pragma once

#include <vector>

#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/model/robot.hpp"

namespace cdprcal {

/// Orientations in which a platform may hang, the likeliest first:
/// platform z up and turned about it so that the anchors face their own pulleys (least squares);
/// the centre of mass straight below the anchors (when that differs by over 30°); then, the
/// unlikely ones, quarter turns, tilts of 60° and upside-down ones. Turning the robot about the
/// vertical turns them all alike.
struct StartRotations {
  std::vector<Eigen::Quaterniond> all;
  std::size_t likely = 0;  ///< of them, the first
};
StartRotations start_rotations(const Robot& robot);

/// Pose with this rotation, the anchors' centroid under the weighted centroid of the pulleys,
/// `drop_m` below it. Weights ≥ 0, one a cable; all zero counts as equal.
Pose hanging_pose(const Robot& robot, const Eigen::Quaterniond& rotation,
                  const CableVector& weights, double drop_m);

/// The drop at which the vertical forces of these tensions carry the weight, in that family; the
/// robot's size when no depth is enough, and the tensions cannot carry the platform there.
double drop_for_tensions(const Robot& robot, const Eigen::Quaterniond& rotation,
                         const CableVector& tension_N);

/// The drop at which the cables' lengths add up to those given (closest in range otherwise).
double drop_for_lengths(const Robot& robot, const Eigen::Quaterniond& rotation,
                        const CableVector& length_m);

}  // namespace cdprcal
