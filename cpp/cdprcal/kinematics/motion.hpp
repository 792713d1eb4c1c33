// What a platform may do where guides, or belts in a plane, leave it less than six freedoms.
#pragma once

#include <optional>

#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/model/robot.hpp"

namespace cdprcal {

/// Whether anything is held but by the cables.
inline bool is_guided(const Robot& robot) { return robot.platform.motion != Motion::r3t3; }

/// Orthonormal columns: the twists that the platform may make. Shifts first.
using TwistBasis = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;
TwistBasis motion_basis(const Robot& robot);
/// The twists that its guides prevent, and the wrenches that these carry.
TwistBasis guided_basis(const Robot& robot);
/// What of a twist the platform may make, or of a wrench the cables must carry; the identity where
/// nothing is guided.
Matrix6 motion_projector(const Robot& robot);
/// How many freedoms it has: 6, 3 or 2.
inline int freedoms(const Robot& robot) {
  const MotionRow& row = row_of(robot.platform.motion);
  return row.turns + row.shifts;
}

/// The axis of the world (0, 1, 2) that a planar platform's plane is across; nothing where it is
/// not planar. Throws InputError for a plane across none of them: boxes and grids lie along axes.
std::optional<int> axis_across(const Robot& robot);

/// The pose that the platform can take nearest to one: in its plane, turned about its normal, or
/// not turned at all.
Pose on_motion(const Robot& robot, const Pose& pose);
/// Whether its guides let the platform be there, to a micrometre and a microradian.
bool is_on_motion(const Robot& robot, const Pose& pose);

}  // namespace cdprcal
