#include "cdprcal/simulator/written_effects.hpp"

namespace cdprcal {
namespace {

/// A place with nothing in it yet: what effects then add is what they do.
PoseEvaluation nothing(int n) {
  PoseEvaluation e;
  e.length_m.setZero(n);
  e.swivel_rad.setZero(n);
  e.roll_pitch_yaw_rad.setZero();
  e.wrench.setZero();
  e.length_by_twist.setZero(n, 6);
  e.swivel_by_twist.setZero(n, 6);
  e.attitude_by_twist.setZero();
  e.wrench_by_twist.setZero();
  return e;
}

/// What formulas may ask for beside the pose. Tensions are those at the load cells.
Measurement asked_of(const PlantDynamics& plant, int n) {
  Measurement m;
  m.run_time_s = plant.time_s();
  m.length_direction.resize(n);
  m.tension_N.resize(n);
  for (int i = 0; i < n; ++i) {
    m.length_direction[i] = plant.direction(i);
    m.tension_N[i] = plant.load_cell_tension_N(i);
  }
  return m;
}

}  // namespace

WrittenReadings written_readings(const PlantParameters& parameters, const PlantDynamics& plant,
                                 const CableVector& swivel_direction) {
  const int n = parameters.robot.cable_count();
  const Pose pose = plant.pose();
  const PlatformState state = platform_state(parameters.robot, pose);
  Measurement m = asked_of(plant, n);
  m.swivel_direction = swivel_direction;
  const Vector3 angles = euler_from_rotation(state.rotation, parameters.robot.euler_convention);
  m.attitude_rate_rad_s = euler_rate_matrix(angles, parameters.robot.euler_convention).inverse() *
                          (pose.rotation * plant.motion().body_rate_rad_s);
  // A formula makes the tension of the reading: the reading is what leads there.
  const CableVector tension_N = m.tension_N;
  constexpr int kRounds = 20;
  for (int round = 0; round < kRounds; ++round) {
    CableVector made_N = m.tension_N;
    for (const ActiveEffect& active : parameters.written) {
      active.effect->correct_tension({parameters.robot, state, pose, m}, active.values, made_N);
    }
    m.tension_N += tension_N - made_N;
  }
  PoseEvaluation e = nothing(n);
  for (const ActiveEffect& active : parameters.written) {
    active.effect->add_to_readings({parameters.robot, state, pose, m}, active.values, e);
  }
  return {e.length_m, e.swivel_rad, m.tension_N, e.roll_pitch_yaw_rad};
}

Vector6 written_wrench(const PlantParameters& parameters, const PlantDynamics& plant,
                       const Pose& pose) {
  const int n = parameters.robot.cable_count();
  const Measurement m = asked_of(plant, n);
  PoseEvaluation e = nothing(n);
  const PlatformState state = platform_state(parameters.robot, pose);
  for (const ActiveEffect& active : parameters.written) {
    active.effect->add_to_readings({parameters.robot, state, pose, m}, active.values, e);
  }
  // The balance has it with the other sign, and about the platform's origin.
  Vector6 wrench = -e.wrench;
  const Vector3 force = wrench.head<3>();
  wrench.tail<3>() -= state.centre_of_mass_arm_m.cross(force);
  return wrench;
}

}  // namespace cdprcal
