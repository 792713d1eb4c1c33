// Accelerometer and gyroscope of the simulated robot.
#pragma once

#include <deque>

#include "cdprcal/simulator/dynamics.hpp"
#include "cdprcal/startup/robot_sample.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal {

/// Reads the mean over the last milliseconds, as a unit of that bandwidth does: the velocity that
/// its place gained, and how far it turned, in its own axes.
class InertialUnit {
 public:
  InertialUnit(const PlantParameters& parameters, const SensorOptions& options);

  /// At the plant's present motion, with biases and noise of these streams.
  void reset(const PlantDynamics& plant, RandomNormal biases, RandomNormal noise);
  /// To be called after every step of the plant.
  void update(const PlantDynamics& plant);
  /// Readings of the motion as it was the delay ago.
  void read(RobotSample& sample);

 private:
  struct Moment {
    double time_s = 0.0;
    Vector3 velocity_m_s;  ///< of its place, world axes
    Eigen::Quaterniond rotation;
  };
  [[nodiscard]] Moment at(double time_s) const;

  SensorOptions options_;
  double delay_s_;
  Vector3 up_m_s2_;        ///< what holds it against gravity, in the frame's axes
  Vector3 from_centre_m_;  ///< to its place, platform axes
  std::deque<Moment> moments_;
  Vector3 force_bias_m_s2_, rate_bias_rad_s_;
  RandomNormal noise_{0};
};

}  // namespace cdprcal
