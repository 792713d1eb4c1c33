// What a platform may do where guides, or belts in a plane, leave it less than six freedoms.
#pragma once

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
/// How many freedoms it has: 6, 3 or 2.
inline int freedoms(const Robot& robot) {
  const MotionRow& row = row_of(robot.platform.motion);
  return row.turns + row.shifts;
}

/// Throws InputError where `what` is to be done for a platform that is guided, and does not know
/// guides.
void refuse_guided(const Robot& robot, const std::string& what);

/// The pose that the platform can take nearest to one: in its plane, turned about its normal, or
/// not turned at all.
Pose on_motion(const Robot& robot, const Pose& pose);

}  // namespace cdprcal
