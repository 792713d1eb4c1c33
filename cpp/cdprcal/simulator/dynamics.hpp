// The moving plant: a rigid platform on n elastic strands, and the winches that wind them.
//
// Integrator: an energy–momentum scheme. The platform follows Simo and Wong (1991): its rotation
// over a step is the Cayley transform of the mean body rate, its spatial angular momentum changes
// by exactly h × moment. Each strand pulls with the discrete gradient (Gonzalez 1996) of its
// elastic energy ½k max(0, l − w)², along a mean direction that makes the work equal to the change
// of length. Kinetic + elastic + gravity energy is then constant to the accuracy of the step's
// equation (1e-12 m/s), whatever the step, also through slack, although the strands vibrate at
// hundreds of hertz. An explicit scheme would need steps below 0.1 ms for them. Sag and damping are
// not in the discrete gradient: a sagging strand is evaluated at the middle of the step.
// A guided platform keeps to its motion without friction: n is the same in its own axes and in the
// world, so what guides prevent is left out of velocities, rates and the step's equation alike.
#pragma once

#include <array>

#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/simulator/plant_parameters.hpp"
#include "cdprcal/simulator/strand.hpp"

namespace cdprcal {

/// What the drives are told, one number a cable: a speed of pay-out [m/s, by the encoder], or a
/// tension [N], by the mode of its drive.
struct WinchCommand {
  std::array<WinchMode, kMaxCables> mode{};  ///< velocity
  CableVector values;
  CableVector reading_error_N;  ///< tension mode: reading − tension of the load cells, now
};

/// The platform's motion: rates about and of the centre of mass.
struct PlatformMotion {
  Vector3 centre_of_mass_m = Vector3::Zero();                    ///< world
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< R_world_platform
  Vector3 velocity_m_s = Vector3::Zero();     ///< of the centre of mass, world axes
  Vector3 body_rate_rad_s = Vector3::Zero();  ///< platform axes
};

struct PlantEnergy {
  double kinetic_J = 0.0;
  double gravity_J = 0.0;
  double pulled_J = 0.0;  ///< of what hangs on the platform
  double elastic_J = 0.0;
  double drums_J = 0.0;  ///< torque mode
  double wound_J = 0.0;  ///< strain energy that went onto the drums with the cable, since the start
  [[nodiscard]] double total_J() const {
    return kinetic_J + gravity_J + pulled_J + elastic_J + drums_J + wound_J;
  }
};

enum class StepStatus {
  done,
  into_pulley,  ///< a cable's anchor came inside its pulley or onto its swivel axis
  not_solved    ///< the step's equations have no solution that was found
};

class PlantDynamics {
 public:
  PlantDynamics(const PlantParameters& parameters, const SimulatorOptions& options);

  /// At rest at a pose with these strand tensions at the pulley [N]; time 0.
  void place(const Pose& pose, const CableVector& tension_N);
  void set_motion(const Vector3& velocity_m_s, const Vector3& body_rate_rad_s);

  /// One step of the integrator. Unless it is done the state is the last good one.
  StepStatus step(const WinchCommand& command);

  /// A knock: impulse [N s, world] at the platform anchor of a cable.
  void knock(int cable, const Vector3& impulse_N_s);
  /// Lets cable run off; `seen` by the encoder or not.
  void run_off(int cable, double length_m, bool seen);
  /// Pulls at the platform from now on, beside all that does already.
  void pull_from_now(const PlantSpring& spring);

  [[nodiscard]] double time_s() const { return static_cast<double>(steps_) * h_; }
  [[nodiscard]] Pose pose() const;
  [[nodiscard]] const PlatformMotion& motion() const { return motion_; }
  [[nodiscard]] const StrandState& strand(int cable) const { return strand_[cable]; }
  /// Tension at the pulley, on the strand's side, and at the load cell [N].
  [[nodiscard]] double strand_tension_N(int cable) const;
  [[nodiscard]] double load_cell_tension_N(int cable) const;
  /// What the encoder counts [m], before noise and offset.
  [[nodiscard]] double encoder_m(int cable) const;
  /// Direction of cable motion s in [−1, 1].
  [[nodiscard]] double direction(int cable) const;
  [[nodiscard]] CableRun cable_run(int cable) const;
  [[nodiscard]] PlantEnergy energy() const;
  /// Net force and moment about the centre of mass on a platform at rest at `pose` under strand
  /// tensions at the pulley [N, Nm], world axes. For finding the equilibrium; NaN where invalid.
  [[nodiscard]] Vector6 net_wrench(const Pose& pose, const CableVector& tension_N) const;

 private:
  /// Adds what the plant's springs do, about the centre of mass, with the platform there.
  void add_springs(const Vector3& centre_of_mass_m, const Matrix3& rotation, Vector3& force_N,
                   Vector3& moment_Nm) const;

  struct Winch {
    double payout_m = 0.0;             ///< by the drum's true circumference
    double encoder_m = 0.0;            ///< where an encoder with play is
    double velocity_m_s = 0.0;         ///< of the true pay-out
    double slipped_m = 0.0;            ///< run off unseen by the encoder
    std::array<double, 3> friction{};  ///< states of the friction elements, each in [−1, 1]
    Vector3 give_m = Vector3::Zero();  ///< how far the frame gives way at the pulley
    double chord_N = 0.0;              ///< mean chord tension of the last step
  };
  struct Pull {
    double tension_N = 0.0;
    double by_length_N_m = 0.0;  ///< ∂T/∂(length at the end of the step)
    double payout_1_m = 0.0, velocity_1_m_s = 0.0;
  };
  [[nodiscard]] double natural_m(int cable, double payout_m) const;
  [[nodiscard]] Vector3 pulley_to_anchor(int cable, const Vector3& anchor_m) const;
  [[nodiscard]] double drop_m(int cable) const;
  [[nodiscard]] Pull pull(int cable, const StrandState& end, const WinchCommand& command) const;
  /// Mean chord tension over the step if the pay-out ends there, and its derivative by length.
  [[nodiscard]] double mean_tension_N(int cable, const StrandState& end, double payout_1_m,
                                      double& by_length_N_m) const;
  [[nodiscard]] double wound_J(int cable, const StrandState& end, double payout_1_m) const;
  void finish_step(const std::array<Pull, kMaxCables>& pulls);

  PlantParameters p_;
  WinchOptions winch_options_;
  StrandLaw law_;
  double h_;
  FreeMotion free_;  ///< guides take no part of the platform's energy
  double translation_damping_N_s_m_, rotation_decay_s_;
  double drum_kg_, drum_damping_N_s_m_;  ///< torque mode, at the rim
  double virtual_kg_, dashpot_N_s_m_;    ///< tension mode: the same equation
  int n_;
  CableVector direction_left_;                            ///< by what moved before power-on
  std::array<Vector3, kMaxCables> anchor_from_centre_m_;  ///< a′ − s′, platform axes
  std::int64_t steps_ = 0;
  double wound_J_ = 0.0;
  PlatformMotion motion_;
  std::array<StrandState, kMaxCables> strand_;
  std::array<Vector3, kMaxCables> arm_m_;  ///< from centre of mass to anchor, world axes
  std::array<Winch, kMaxCables> winch_;
};

}  // namespace cdprcal
