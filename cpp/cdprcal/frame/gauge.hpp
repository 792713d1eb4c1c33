// Private to frame/: where a frame is that no reading shows, by what is known and by convention.
#pragma once

#include "cdprcal/frame/rows.hpp"

namespace cdprcal::detail {

/// Pulleys in the order in which they are asked for the place of the frame: those that are `known`
/// first, else in the file's order; but the second is away from the first, and the third from the
/// line of these, nearly as far as any.
std::vector<int> reference_pulleys(const Robot& robot, const std::vector<bool>& known);

/// Axes by the first three of them: the first axis points from one to the next, the last is normal
/// to all three (to the plane of motion of planar robots), the second is towards the third.
Matrix3 reference_axes(const Robot& robot, const std::vector<int>& reference);

/// Rigid motions of all pulleys from where they are, as shifts along the unknowns' axes: a column
/// each.
Eigen::MatrixXd rigid_motions(const FrameUnknowns& u, const Robot& robot);
/// Whether what is known of pulleys beforehand fixes where the frame is and how it is turned.
bool fixes_place(const FrameUnknowns& u, const Robot& robot);

/// Holds as many coordinates as what is known of pulleys leaves rigid motions, and none that takes
/// part in what is known: of the first reference pulley its place, of the second its direction, of
/// the third the plane.
void hold_place(const Robot& robot, FrameUnknowns& u);

}  // namespace cdprcal::detail
