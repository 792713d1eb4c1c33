// Private to simulator/: what effects that a person wrote as text do in the machine.
//
// The physics of the catalogue is written anew for the plant. A formula is the physics, and is
// evaluated by the same code here and in the estimator, at the plant's true state.
#pragma once

#include "cdprcal/simulator/dynamics.hpp"

namespace cdprcal {

/// What they add to what the sensors would tell.
struct WrittenReadings {
  CableVector length_m, swivel_rad;
  CableVector load_cell_N;  ///< what the cells show instead of the tensions there
  Vector3 roll_pitch_yaw_rad = Vector3::Zero();
};

/// At the plant's present state; `swivel_direction` as Measurement has it.
WrittenReadings written_readings(const PlantParameters& parameters, const PlantDynamics& plant,
                                 const CableVector& swivel_direction);

/// Force and moment about the centre of mass [N, Nm], world axes, at a pose; what formulas ask for
/// beside it is the plant's present state.
Vector6 written_wrench(const PlantParameters& parameters, const PlantDynamics& plant,
                       const Pose& pose);

}  // namespace cdprcal
