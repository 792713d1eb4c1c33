// What a fit leaves of the readings, in their own units.
#pragma once

#include "cdprcal/model/sensors.hpp"

namespace cdprcal {

/// Root mean square of the unweighted residuals, a channel; NaN where nothing measured it.
struct ResidualRms : AbsoluteFields<NumberOf> {
  double length_m = kNaN;
  double swivel_rad = kNaN;
  double roll_pitch_rad = kNaN;
  double yaw_rad = kNaN;
  double tension_N = kNaN;
  double wrench_force_N = kNaN;
  double wrench_moment_Nm = kNaN;
};

/// Residuals at one pose, measured minus … as in eq. 13 (modelled − measured); NaN where absent.
struct PoseResidual : AbsoluteFields<ReadingOf> {
  CableVector length_m;
  CableVector swivel_rad;
  CableVector tension_N;
  Vector3 roll_pitch_yaw_rad = Vector3::Constant(kNaN);
  Vector6 wrench = Vector6::Constant(kNaN);  ///< Ξᵀτ* − f [N, Nm]
};

}  // namespace cdprcal
