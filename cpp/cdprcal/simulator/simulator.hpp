// A simulated robot: drives, cables, platform and sensors on a virtual clock.
//
//   Simulator simulator(robot, options);
//   simulator.reset(tension_N);                 // hangs at rest under these tensions
//   simulator.command_velocity(velocity_m_s);
//   simulator.advance(0.01);
//   RobotSample sample = simulator.read();
//
// The physics are not the estimator's: the platform has inertia and moves, cables are elastic and
// can go slack, drives lag, effects act where they act in the machine. The same seed, options and
// commands give the same readings to the last bit.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "cdprcal/simulator/sensors.hpp"

namespace cdprcal {

/// What the sensors do not say.
struct PlantTruth {
  double time_s = 0.0;
  Pose pose;
  Vector6 twist = Vector6::Zero();  ///< of P: velocity [m/s], angular velocity [rad/s], world axes
  CableVector tension_N;            ///< of the strands, at the pulley
  CableVector load_cell_N;          ///< at the load cells, before their errors
  CableVector direction;            ///< s in [−1, 1]: +1 after paying out
  PlantEnergy energy;
};

/// Whether the robot could be put somewhere at rest.
struct RestResult {
  bool found = false;
  std::string reason;     ///< one sentence when not
  Pose pose;              ///< the true one
  CableVector tension_N;  ///< the true ones
};

class Simulator {
 public:
  /// The effects that the robot lists act too. Throws InputError for impossible options and for
  /// effects that do not fit the robot.
  explicit Simulator(const Robot& robot, const SimulatorOptions& options = {});
  /// The plant as plant_parameters made it of robot and options, and as was changed in it since.
  Simulator(PlantParameters parameters, const SimulatorOptions& options);

  /// At rest under these true tensions [N], n values > 0; found by the direct problem of the true
  /// robot, effects included. `near`: the equilibrium closest to it, when there are several. Time,
  /// sensors and noise start over. When none is found nothing has changed.
  RestResult reset(const CableVector& tension_N, const Pose* near = nullptr);
  /// At rest with the cable lengths of this pose: where the platform hangs when the winches are
  /// locked there. It is the pose itself if that is an equilibrium.
  RestResult reset(const Pose& pose);
  /// At rest at this very pose, held by the lengths of six cables and more, under the tensions in
  /// balance there that are closest to these [N].
  RestResult reset(const Pose& pose, const CableVector& tension_N);

  /// Speeds of pay-out by the encoder [m/s], n values; drives in velocity mode.
  void command_velocity(const CableVector& velocity_m_s);
  /// Tensions [N], n values: set-points of the drives' own tension loops, or motor tensions when
  /// options say torque mode.
  void command_tension(const CableVector& tension_N);
  /// Each drive by itself: true, its tension; false, its speed of pay-out. n values each. In torque
  /// mode all or none, else throws InputError: motors that only pull hold no pose.
  void command_each(const CableVector& velocity_m_s, const CableVector& tension_N,
                    const std::vector<bool>& by_tension);
  /// Winches stopped and locked.
  void hold();

  /// Lets time pass, to the closest multiple of the step. False: the platform ran into a pulley, or
  /// the cable onto it; the world stands still from then on.
  bool advance(double duration_s);

  [[nodiscard]] double time_s() const { return dynamics_.time_s(); }
  /// The latest readings.
  [[nodiscard]] RobotSample read() const { return sensors_.sample(); }
  [[nodiscard]] PlantTruth truth() const;
  /// Constant offsets of the readings.
  [[nodiscard]] const ReadingOffsets& offsets() const { return sensors_.offsets(); }
  [[nodiscard]] const PlantParameters& parameters() const { return parameters_; }
  [[nodiscard]] const SimulatorOptions& options() const { return options_; }
  /// Why the world stands still; empty when it does not.
  [[nodiscard]] const std::string& crashed() const { return crashed_; }

  /// Sets the platform moving: velocity of the centre of mass [m/s, world], rate [rad/s, platform].
  void push(const Vector3& velocity_m_s, const Vector3& body_rate_rad_s);

 private:
  RestResult start_at(const Pose& pose, const CableVector& tension_N);
  RestResult begin(RestResult rest);
  void happen();
  void note_reading_error();

  SimulatorOptions options_;
  PlantParameters parameters_;
  PlantDynamics dynamics_;
  SensorBank sensors_;
  WinchCommand command_;
  bool reads_tension_ = false;  ///< some drive has a tension loop of its own
  std::size_t next_event_ = 0;
  std::string crashed_;
};

}  // namespace cdprcal
