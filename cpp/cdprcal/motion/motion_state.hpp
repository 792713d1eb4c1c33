// The platform in motion: pose, twist and acceleration, and how they follow from one another when
// nothing is known of the forces.
#pragma once

#include "cdprcal/geometry/pose.hpp"

namespace cdprcal {

/// A pose and its derivatives in world axes: twist ν = (velocity of P [m/s], angular velocity
/// [rad/s]) and dν/dt.
struct MotionState {
  Pose pose;
  Vector6 twist = Vector6::Zero();
  Vector6 acceleration = Vector6::Zero();
};

/// Unknowns of a state: (δp, δθ), δν, δν̇.
inline constexpr int kMotionUnknowns = 18;
using MotionVector = Eigen::Matrix<double, kMotionUnknowns, 1>;
using MotionMatrix = Eigen::Matrix<double, kMotionUnknowns, kMotionUnknowns>;

MotionState plus(const MotionState& state, const MotionVector& change);
/// After `dt_s` at constant acceleration.
MotionState moved(const MotionState& state, double dt_s);

/// Under white jerk (Singer 1970 without decay; Barfoot, State Estimation for Robotics, §3.4): how
/// the error of a state goes on to the next, and what jerk adds to its covariance.
MotionMatrix transition(const MotionState& state, double dt_s);
Matrix3 jerk_covariance(double dt_s);  ///< one axis, density 1: position, velocity, acceleration

}  // namespace cdprcal
