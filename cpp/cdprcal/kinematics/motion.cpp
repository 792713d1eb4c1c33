#include "cdprcal/kinematics/motion.hpp"

#include "cdprcal/decompositions.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

/// Orthonormal directions in a plane.
Eigen::Matrix<double, 3, 2> plane(const Vector3& normal) {
  const Matrix3 basis = householder_q(normal);
  return basis.rightCols<2>();
}

/// A basis of shifts and one of turns, one after the other.
template <typename Shifts, typename Turns>
TwistBasis side_by_side(const Shifts& shifts, const Turns& turns) {
  TwistBasis out = TwistBasis::Zero(6, shifts.cols() + turns.cols());
  out.topLeftCorner(3, shifts.cols()) = shifts;
  out.bottomRightCorner(3, turns.cols()) = turns;
  return out;
}

}  // namespace

TwistBasis motion_basis(const Robot& robot) {
  const Vector3& normal = robot.platform.motion_plane_normal;
  const Eigen::Matrix<double, 3, 0> none(3, 0);
  switch (robot.platform.motion) {
    case Motion::r3t3:
      break;
    case Motion::t3:
      return side_by_side(Matrix3::Identity(), none);
    case Motion::r1t2:
      return side_by_side(plane(normal), normal);
    case Motion::t2:
      return side_by_side(plane(normal), none);
  }
  return Matrix6::Identity();
}

TwistBasis guided_basis(const Robot& robot) {
  const Vector3& normal = robot.platform.motion_plane_normal;
  switch (robot.platform.motion) {
    case Motion::r3t3:
      break;
    case Motion::t3:
      return side_by_side(Eigen::Matrix<double, 3, 0>(3, 0), Matrix3::Identity());
    case Motion::r1t2:
      return side_by_side(normal, plane(normal));
    case Motion::t2:
      return side_by_side(normal, Matrix3::Identity());
  }
  return TwistBasis(6, 0);
}

FreeMotion::FreeMotion(const Robot& robot) : guided_(cdprcal::is_guided(robot)) {
  const TwistBasis free = motion_basis(robot);
  projector_ = free * free.transpose();
  const TwistBasis guided = guided_basis(robot);
  across_ = guided * guided.transpose();
}

std::optional<int> axis_across(const Robot& robot) {
  if (!row_of(robot.platform.motion).is_planar()) return std::nullopt;
  int axis = 0;
  constexpr double kAlong = 1e-9;  // what a normal written with 16 digits may be off
  if (robot.platform.motion_plane_normal.cwiseAbs().maxCoeff(&axis) < 1.0 - kAlong) {
    throw InputError(robot.name +
                     ": platform.motion_plane_normal is along no axis of the world, as boxes and "
                     "grids are; turn the frame of the robot file");
  }
  return axis;
}

Pose on_motion(const Robot& robot, const Pose& pose) {
  if (!is_guided(robot)) return pose;
  const MotionRow& motion = row_of(robot.platform.motion);
  const Vector3& normal = robot.platform.motion_plane_normal;
  Pose out = pose;
  if (motion.is_planar()) out.position_m -= normal.dot(pose.position_m) * normal;
  if (motion.is_point()) {
    out.rotation.setIdentity();
  } else {  // the twist about the normal of swing and twist
    const double along = pose.rotation.vec().dot(normal);
    out.rotation = Eigen::Quaterniond(pose.rotation.w(), along * normal.x(), along * normal.y(),
                                      along * normal.z());
    const double size = out.rotation.norm();
    if (size > 1e-9) {
      out.rotation.coeffs() /= size;
    } else {
      out.rotation.setIdentity();  // turned over: any turn is as near
    }
  }
  return out;
}

bool is_on_motion(const Robot& robot, const Pose& pose) {
  constexpr double kOff = 1e-6;
  return !is_guided(robot) || minus(on_motion(robot, pose), pose).norm() <= kOff;
}

}  // namespace cdprcal
