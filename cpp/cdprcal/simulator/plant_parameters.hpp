// The plant as numbers: the robot as it truly is, every injected effect in its place.
#pragma once

#include <vector>

#include "cdprcal/model/robot.hpp"
#include "cdprcal/simulator/options.hpp"

namespace cdprcal {

/// Something that happens once.
struct PlantEvent {
  enum class Kind { slack, cable_slip, oscillation, outlier };
  Kind kind = Kind::slack;
  double time_s = 0.0;
  int cable = 0;      ///< from 0
  double size = 0.0;  ///< m, or N s for oscillation
};

struct PlantParameters {
  Robot robot;  ///< true geometry and inertia
  // Cables and winches
  double axial_stiffness_N = 0.0;  ///< EA
  double strand_damping_ratio = 0.0;
  double linear_density_kg_m = 0.0;
  double creep_m = 0.0;     ///< per decade of 1 + t/30 s
  CableVector ratio_error;  ///< encoder length ÷ paid-out length − 1
  double runout_m = 0.0;
  double drum_circumference_m = 1.0;
  // Between load cell and strand, s = ±1: load cell = τ e^{−sμ} − s (f₀ + f₁ τ)
  double friction = 0.0;
  double hysteresis_N = 0.0;
  double hysteresis = 0.0;
  // Load cells
  CableVector load_cell_gain;  ///< reading = (1 + gain) τ + bias + drift t
  CableVector load_cell_bias_N;
  double load_cell_drift_N_s = 0.0;
  // Swivels
  CableVector swivel_scale;
  double swivel_half_width_rad = 0.0;
  // Platform
  Vector3 external_force_N = Vector3::Zero();
  // AHRS
  Eigen::Quaterniond ahrs_rotation = Eigen::Quaterniond::Identity();  ///< R* = R · this
  double yaw_drift_rad_s = 0.0;
  Vector3 magnetic_rad_m = Vector3::Zero();
  double attitude_delay_s = 0.0;  ///< on top of the sensor's own
  // Maps from the sensor to the log
  CableVector length_sign, swivel_sign;
  std::vector<int> cable_order;  ///< reading i is that of this cable
  double length_factor = 1.0, swivel_factor = 1.0, attitude_factor = 1.0;
  EulerConvention euler_convention = EulerConvention::XYZ;
  // Outside the catalogue
  double frame_compliance_m_N = 0.0;
  double warming_time_s = 0.0, warming_K = 0.0;
  std::vector<PlantEvent> events;  ///< by time

  /// How much longer the cable's natural length is than paid out [m]: creep, warmth.
  [[nodiscard]] double grown_m(double time_s, double paid_out_m) const;
  /// What warmth adds to a load cell's reading [N].
  [[nodiscard]] double warm_zero_N(double time_s) const;
  /// Tension at the load cell [N] from that of the strand and the direction of motion s.
  [[nodiscard]] double load_cell_side_N(double strand_N, double direction) const;
};

/// Throws InputError for impossible options and for effects that do not fit the robot.
PlantParameters plant_parameters(const Robot& robot, const SimulatorOptions& options);

}  // namespace cdprcal
