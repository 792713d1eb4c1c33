// The sensors of the simulated robot: rate, delay, noise, quantisation, bias, unknown offsets.
#pragma once

#include <deque>

#include "cdprcal/simulator/dynamics.hpp"
#include "cdprcal/simulator/inertial_unit.hpp"
#include "cdprcal/startup/robot_sample.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal {

/// The world as ideal sensors would see it at one moment.
struct PlantSnapshot {
  double time_s = 0.0;
  Pose pose;
  CableVector encoder_m, swivel_rad, load_cell_N;
  Vector3 written_rad = Vector3::Zero();  ///< what formulas add to roll, pitch and yaw
};

class SensorBank {
 public:
  SensorBank(const PlantParameters& parameters, const SimulatorOptions& options);

  /// Starts over at time 0: new offsets and noise from the seed, first readings.
  void reset(const PlantDynamics& plant);
  /// To be called after every step of the plant.
  void update(const PlantDynamics& plant);

  /// The latest readings.
  [[nodiscard]] const RobotSample& sample() const { return sample_; }
  /// By how much a drive that reads its own load cell now finds it off [N]: the systematic errors
  /// of the readings, and fresh noise.
  [[nodiscard]] const CableVector& drive_reading_error_N(const PlantDynamics& plant);
  [[nodiscard]] const ReadingOffsets& offsets() const { return offsets_; }

 private:
  struct Clock {
    double period_s = 0.01, delay_s = 0.0;
    std::int64_t taken = 0;
    [[nodiscard]] bool due(double time_s) const {
      return time_s >= static_cast<double>(taken) * period_s - 1e-9;
    }
  };
  [[nodiscard]] PlantSnapshot snapshot(const PlantDynamics& plant);
  void add_written(const PlantDynamics& plant, PlantSnapshot& now);
  [[nodiscard]] PlantSnapshot seen(double time_s) const;
  void read_lengths(const PlantSnapshot& world);
  void read_swivels(const PlantSnapshot& world);
  void read_tensions(const PlantSnapshot& world);
  [[nodiscard]] double load_cell_N(int cable, double tension_N, double time_s) const;
  void read_attitude(const PlantSnapshot& world);

  PlantParameters p_;
  SensorOptions options_;
  std::uint64_t seed_;
  double history_s_ = 0.0;
  Clock length_clock_, swivel_clock_, tension_clock_, attitude_clock_;
  RandomNormal drive_noise_{0}, length_noise_{0}, swivel_noise_{0}, tension_noise_{0},
      attitude_noise_{0};
  ReadingOffsets offsets_;
  CableVector swivel_play_rad_;                ///< where the lagging swivels are
  CableVector swivel_seen_rad_, swivel_turn_;  ///< from where they came: −1 … 1
  std::deque<PlantSnapshot> history_;
  InertialUnit unit_;
  RobotSample sample_;
  CableVector drive_error_N_;
};

}  // namespace cdprcal
