// What a robot's drives and AHRS say at one moment: the reading half of the backend protocol.
#pragma once

#include <string>

#include "cdprcal/types.hpp"

namespace cdprcal {

/// Readings as they arrive; NaN: absent. Lengths, swivels and yaw carry unknown constant offsets.
struct RobotSample {
  double time_s = 0.0;     ///< the backend's clock, now
  CableVector length_m;    ///< [n], growing as cable is paid out
  CableVector swivel_rad;  ///< [n], or empty: no such sensors
  CableVector tension_N;   ///< [n]
  Vector3 roll_pitch_yaw_rad = Vector3::Constant(kNaN);
  /// Of an inertial unit, platform axes; NaN: none.
  Vector3 specific_force_m_s2 = Vector3::Constant(kNaN);
  Vector3 angular_velocity_rad_s = Vector3::Constant(kNaN);
  double drives_time_s = kNaN;    ///< when lengths, swivels and tensions last arrived; NaN: now
  double attitude_time_s = kNaN;  ///< when the attitude last arrived; NaN: now
  std::string drive_error;        ///< not empty: a drive is not operational, and why
  std::string host_error;         ///< not empty: this computer cannot go on (disk full), and why
  bool stop_requested = false;    ///< the operator wants to stop
};

}  // namespace cdprcal
