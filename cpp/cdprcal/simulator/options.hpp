// What the simulated robot is made of, beyond what its robot file says.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "cdprcal/simulator/injected_effect.hpp"

namespace cdprcal {

/// Cables. The nominal ones are so stiff that a model with rigid cables is right to a hundredth of
/// a millimetre; the injected effect cable_elasticity replaces the stiffness.
struct StrandOptions {
  /// EA. 0: 10 MN on irma4, where 100 N stretch 1.5 m by 0.015 mm, and in proportion to the weight.
  double axial_stiffness_N = 0.0;
  /// Of the platform's mass hanging on one strand: 0.03 is a loss factor of 6 %, as of fibre ropes.
  double damping_ratio = 0.03;
};

/// Damping of the platform: e-folding times of a free oscillation's amplitude. They stand for all
/// that is lost in air, pulleys and cables: in logs of the real robot residual oscillations die out
/// within two to three seconds. Infinity: none.
struct PlatformDamping {
  double translation_decay_s = 1.0;  ///< force 2m/decay × velocity of the centre of mass
  double rotation_decay_s = 1.0;     ///< moment 2I/decay × angular velocity
};

enum class WinchMode {
  /// CiA-402 cyclic synchronous velocity: the drive follows a commanded speed.
  velocity,
  /// As on the real robot: a velocity drive under its own tension loop at the drive's internal
  /// rate.
  /// Speed of pay-out = gain × (load-cell reading − set-point), after the drive's lag.
  tension,
  /// The motor pulls with a commanded tension, whatever the load cell says; the drum has inertia.
  torque
};

struct WinchOptions {
  WinchMode mode = WinchMode::tension;
  double time_constant_s = 0.01;  ///< of the drive's velocity loop
  double max_velocity_m_s = 1.0;  ///< the drive's own limit; not in torque mode
  /// Tension mode: speed per newton of error. Seen from the platform each winch is then a dashpot
  /// of 1/gain. 0: together these are 4 N s/m per kilogram of platform, which damps the slow modes
  /// of robots of a few metres (2 to 3 rad/s) about critically.
  double tension_gain_m_s_N = 0.0;
  /// Tension mode: white noise of the load cell inside the drive's loop, each millisecond. The data
  /// sheet's accuracy of the real one; what is logged has picked up more on its way. NaN: 0.2 N on
  /// irma4, and in proportion to the weight.
  double tension_noise_N = kNaN;
  double drum_radius_m = 0.05;       ///< torque mode
  double drum_inertia_kg_m2 = 2e-3;  ///< torque mode; motor and gear included
  double drum_damping_Nms = 0.06;    ///< torque mode, bearing and gear: moment ÷ angular velocity
};

/// One kind of sensor. Noise, resolution and bias in the unit of the reading.
struct SensorChannel {
  double noise = 0.0;       ///< white, one σ, each reading
  double resolution = 0.0;  ///< quantisation step; 0 is none
  double bias = 0.0;        ///< constant, the same in every cable
  double rate_Hz = 100.0;   ///< between readings the last one is held
  double delay_s = 0.0;     ///< a reading shows the world this long ago
};

/// As measured on the real robot at rest: 12 to 25 times below paper eq. 18.
struct SensorOptions {
  SensorChannel length_m{0.4e-3, 1e-6};
  SensorChannel swivel_rad{0.08 * kDegree, 2.0 * kPi / 65536.0};
  SensorChannel tension_N{0.8, 0.01};
  SensorChannel roll_pitch_rad{0.08 * kDegree, 1e-6};
  SensorChannel yaw_rad{0.15 * kDegree, 1e-6};  ///< rate and delay are those of roll and pitch
  /// Of the inertial unit that a robot has whose file says where (inertial_unit_m); rate and delay
  /// are those of roll and pitch. As of a MEMS unit, one σ an axis.
  double specific_force_noise_m_s2 = 0.02, specific_force_bias_m_s2 = 0.03;
  double angular_velocity_noise_rad_s = 0.05 * kDegree;
  double angular_velocity_bias_rad_s = 0.1 * kDegree;
  /// Lengths, swivels and yaw start anywhere, and what lags as its last motion left it; false: at
  /// the truth, in the middle of its lag.
  bool random_offsets = true;
};
/// Without noise, quantisation, bias, delay and offsets.
SensorOptions perfect_sensors();

struct SimulatorOptions {
  double step_s = 1e-3;  ///< of the integrator
  StrandOptions strand;
  PlatformDamping damping;
  WinchOptions winch;
  SensorOptions sensors;
  std::vector<InjectedEffect> effects;
  std::uint64_t seed = 1;  ///< of offsets and noise
};

}  // namespace cdprcal
