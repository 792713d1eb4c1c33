// What was read at one pose, and how measurements are drawn from a log.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "cdprcal/model/robot.hpp"
#include "cdprcal/readings/channel.hpp"
#include "cdprcal/readings/equilibrium_detection.hpp"
#include "cdprcal/readings/path_state.hpp"

namespace cdprcal {

/// static_pose: the platform rests, statics hold. kinematic_pose: it may move, geometry only.
enum class PoseKind { static_pose, kinematic_pose };

/// Readings at one pose; NaN where absent. Lengths, swivels and yaw have unknown offsets that are
/// the same in all measurements of a problem.
struct Measurement : AbsoluteFields<ReadingOf> {
  double time_s = 0.0;
  PoseKind kind = PoseKind::static_pose;
  CableVector length_m;
  CableVector swivel_rad;
  CableVector tension_N;
  Vector3 roll_pitch_yaw_rad = Vector3::Constant(kNaN);
  /// What the tensions were told to be: τ_setpoint of §3.2, for guesses alone. Empty or NaN:
  /// unknown.
  CableVector tension_setpoint_N;

  // How the pose was reached, for effects that depend on it (effects/).
  double run_time_s = 0.0;       ///< since the first sample of the run
  CableVector length_direction;  ///< s in [−1, 1]: +1 after paying out; empty: unknown
  CableVector swivel_direction;  ///< the same for the swivels; +1 after a positive turn
  CableVector length_direction_error,
      swivel_direction_error;  ///< what s may be off (path_state.hpp)
  CableVector length_direction_open,
      swivel_direction_open;                       ///< half of the range that s may be in
  Vector3 attitude_rate_rad_s = Vector3::Zero();   ///< of (roll, pitch, yaw), while moving
  CableVector length_rate_m_s, swivel_rate_rad_s;  ///< empty: unknown
  /// Ξᵀ dτ/dt by the readings [N/s, Nm/s]: what the balance lacks by each second that they are
  /// late.
  Vector6 rising_wrench = Vector6::Zero();
  int samples = 1;  ///< readings behind the mean
  /// How the platform moves, in world axes about P: velocity and angular velocity, and their
  /// derivatives. Zero at rest.
  Vector6 twist = Vector6::Zero(), acceleration = Vector6::Zero();
  /// σ of what its motion takes, in world axes [N, Nm]: the balance is known no better.
  Vector6 inertial_sigma = Vector6::Zero();
  /// What that takes beside the acceleration [N, Nm]: no effect scales it.
  Vector6 excess_wrench = Vector6::Zero();
  bool balance_counts = true;  ///< false: it is left out (a slack cable, an outlier)
  /// The tensions less what a fit's balance takes for their noise; empty: not known.
  CableVector balanced_tension_N;

  /// What a law of the tension looks at: of the reading itself it would find the noise, for what is
  /// left of a reading depends on that.
  [[nodiscard]] const CableVector& tension_of_laws_N() const {
    return balanced_tension_N.size() > 0 ? balanced_tension_N : tension_N;
  }

  /// Whether it balances in motion: rests are the special case of no acceleration.
  bool moves() const { return !twist.isZero() || !acceleration.isZero(); }
  bool rests() const { return kind == PoseKind::static_pose && !moves(); }
  /// Tensions that no load cell reads; what carries them is unknown, but taut.
  int unread_tensions() const { return static_cast<int>(tension_N.array().isNaN().count()); }
  /// Whether the wrench balance says anything here: at rest, with fewer than six tensions unread.
  bool in_balance() const {
    return kind == PoseKind::static_pose && balance_counts && unread_tensions() < 6;
  }
};

/// Readings that say of a pose what another of them says too, but for an offset: whole lengths
/// beside changes of length, absolute yaw beside yaw.
int doubled_readings(const Measurement& m);
/// What `rows` of a pose say of anything but its own unknowns, at most.
inline int spare_rows(const Measurement& m, int rows, int unknowns) {
  return std::max(rows - unknowns, doubled_readings(m));
}
/// The same of its geometric readings alone.
int spare_readings(const Measurement& m, int unknowns);

/// All readings of one sensor, a row of kSensorTable; an absolute one of the cables may be empty.
std::span<double> readings_of(Measurement& m, const Sensor& sensor);
/// The readings of one channel that the pose explains, empty where it has none; those of the
/// balance are the tensions. Of an inertial unit: which way is up, at rest.
Eigen::Map<const Eigen::VectorXd> readings_of(const Measurement& m, Channel channel);

/// The sample at row `index` as a measurement of a robot with `cable_count` cables.
Measurement measurement_at(const Log& log, Eigen::Index index, PoseKind kind, int cable_count);
/// The mean over an interval; time_s is the middle of it.
Measurement measurement_mean(const Log& log, const SampleRange& range, PoseKind kind,
                             int cable_count);

/// The readings of measurements as a log, one row each, a second apart; and back again. What none
/// of them read is absent from the log.
Log log_of(const std::vector<Measurement>& measurements);
void take_readings(const Log& log, std::vector<Measurement>& measurements);

/// Fills in how the pose of `range` was reached (directions: means over the range).
void add_path(const PathState& path, const Log& log, const SampleRange& range, double run_start_s,
              Measurement& measurement);

}  // namespace cdprcal
