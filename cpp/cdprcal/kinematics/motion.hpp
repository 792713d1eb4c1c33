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
/// What of a twist the platform may make, and of a wrench the cables must carry: projections on the
/// span of motion_basis, which cost nothing where nothing is guided.
class FreeMotion {
 public:
  explicit FreeMotion(const Robot& robot);

  [[nodiscard]] bool is_guided() const { return guided_; }
  /// Of twists or wrenches, one a column.
  template <typename Columns>
  [[nodiscard]] typename Columns::PlainObject of(const Eigen::MatrixBase<Columns>& columns) const {
    if (!guided_) return columns;
    return projector_ * columns;
  }
  /// Of a covariance of twists, or of an information about them: zero across.
  [[nodiscard]] Matrix6 of_square(const Matrix6& square) const {
    return guided_ ? Matrix6(projector_ * square * projector_) : square;
  }
  /// Of a stiffness or an inertia: the identity across, so that it can be solved with and a
  /// solution of what is free stays free.
  [[nodiscard]] Matrix6 of_stiffness(const Matrix6& stiffness) const {
    return guided_ ? Matrix6(of_square(stiffness) + across_) : stiffness;
  }
  /// The projector on what guides prevent; zero where nothing is guided.
  [[nodiscard]] const Matrix6& across() const { return across_; }

 private:
  bool guided_;
  Matrix6 projector_, across_;
};
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
