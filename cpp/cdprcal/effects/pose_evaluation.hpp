// What the model predicts at one pose, with derivatives: the one place where readings come from.
#pragma once

#include "cdprcal/readings/measurement.hpp"
#include "cdprcal/statics/tension.hpp"

namespace cdprcal {

struct ActiveEffect;

/// Everything that residuals need at one pose. Jacobians are with respect to a world-frame twist.
///
/// The base: what absolute sensors (a laser or a tape, a compass, a tracker, an accelerometer)
/// read, the geometry without what effects do to the drums' encoders and to the AHRS.
struct PoseEvaluation : AbsoluteFields<ReadingOf> {
  bool valid = false;
  CableVector length_m;
  CableVector swivel_rad;
  Vector3 roll_pitch_yaw_rad;
  /// Left-inverse statics: what the load cells would read. Wrench statics: τ*, the tensions at the
  /// platform as the effects make them of the readings.
  CableVector tension_N;
  Vector6 wrench;  ///< Ξᵀτ* − f + M ν̇ + h(ν), wrench statics only
  CableJacobian length_by_twist;
  CableJacobian swivel_by_twist;
  Eigen::Matrix<double, 3, 6, Eigen::RowMajor> attitude_by_twist;
  AbsoluteFields<JacobianOf> absolute_by_twist;
  CableJacobian tension_by_twist;
  Matrix6 wrench_by_twist;
};

/// Adds what the motion of a measurement takes (inertial_wrench.hpp) to its balance, where it
/// moves.
void add_inertia(const Robot& robot, const PlatformState& state, const Measurement& measurement,
                 PoseEvaluation& out);

/// What lengths, swivels and the attitude are at a pose and its state, without effects and statics.
void evaluate_geometry(const Robot& robot, const PlatformState& state, const Pose& pose,
                       bool with_jacobians, PoseEvaluation& out);

/// Evaluates the models of one pose. `statics` is none for poses that may move. `robot` has the
/// geometry of the effects applied already (with_effects); `effects` then add what they do to the
/// readings. With left-inverse statics (eqs 10–12) tension_N is what the load cells would read.
void evaluate_pose(const Robot& robot, const Measurement& measurement, const Pose& pose,
                   StaticsModel statics, const std::vector<WrenchRow>& left_inverse_rows,
                   const std::vector<ActiveEffect>& effects, bool with_jacobians,
                   PoseEvaluation& out);

}  // namespace cdprcal
