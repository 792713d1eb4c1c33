// The plant as numbers: the robot as it truly is, every injected effect in its place.
#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include "cdprcal/effects/effect.hpp"
#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/simulator/options.hpp"

namespace cdprcal {

class PlantDynamics;

/// Something that happens once.
struct PlantEvent {
  double time_s = 0.0;
  std::function<void(PlantDynamics&)> happen;
};

/// How a cable runs over its pulleys.
struct CableRun {
  double direction = 0.0;   ///< s
  double speed_m_s = 0.0;   ///< paying out
  double swivel_rad = 0.0;  ///< of its pulley
};

/// What pulls at the platform: as a spring does, whichever way, or with the same force everywhere.
struct PlantSpring {
  Vector3 force_N;                    ///< at `origin_m`; world axes, as all but `point_m`
  Vector3 point_m = Vector3::Zero();  ///< where, from the centre of mass in platform axes
  Vector3 origin_m = Vector3::Zero();
  Matrix3 stiffness_N_m = Matrix3::Zero();  ///< symmetric

  [[nodiscard]] Vector3 pull_N(const Vector3& at_m) const {
    return force_N - stiffness_N_m * (at_m - origin_m);
  }
  [[nodiscard]] double energy_J(const Vector3& at_m) const {
    const Vector3 from_m = at_m - origin_m;
    return 0.5 * from_m.dot(stiffness_N_m * from_m) - force_N.dot(from_m);
  }
};

/// What effects make of one cable's number: (number so far, cable from 0, time [s]) → number.
using CableChange = std::function<double(double, int, double)>;

/// What a card of plant_effects.cpp may change. Effects act in the order of the table.
struct PlantParameters {
  Robot robot;  ///< true geometry and inertia
  // Cables and winches
  double axial_stiffness_N = 0.0;  ///< EA
  double drive_noise_N = 0.0;      ///< WinchOptions::tension_noise_N
  double strand_damping_ratio = 0.0;
  double linear_density_kg_m = 0.0;
  double frame_compliance_m_N = 0.0;   ///< of each pulley's place, along the pull
  double frame_creep_m_N = 0.0;        ///< what that grows by in each decade of 1 + t / 30 s
  std::vector<CableChange> natural_m;  ///< from what is paid out to the strand's natural length
  CableVector ratio_error;             ///< encoder length ÷ paid-out length − 1
  double encoder_half_play_m = 0.0;    ///< between encoder and drum, by which the encoder lags
  std::vector<CableChange> encoder_m;  ///< on top of the ratio
  std::vector<PlantEvent> events;      ///< by time
  // Platform
  std::vector<PlantSpring> springs;
  ActiveEffects written;  ///< effects of formulas, beside what they change of `robot`
  // Load cells
  /// From strand to load cell, by how the cable runs: (so far, strand [N], run) → load [N].
  std::vector<std::function<double(double, double, const CableRun&)>> to_load_cell_N;
  std::vector<CableChange> load_cell_N;  ///< from load to the force that the bridge shows
  double load_cell_cross_talk = 0.0;     ///< share of all others' loads that a bridge shows
  CableVector load_cell_gain;            ///< the amplifier's, of all that the bridge shows
  // Swivels
  double swivel_half_width_rad = 0.0;  ///< of their play
  std::vector<CableChange> swivel_rad;
  // AHRS
  Eigen::Quaterniond level = Eigen::Quaterniond::Identity();          ///< from frame to level axes
  Eigen::Quaterniond ahrs_rotation = Eigen::Quaterniond::Identity();  ///< R* = level · R · this
  EulerConvention euler_convention = EulerConvention::XYZ;
  /// (true pose, time [s], roll pitch yaw to change)
  std::vector<std::function<void(const Pose&, double, Vector3&)>> attitude_rad;
  // On top of the sensors' own
  double attitude_delay_s = 0.0, length_delay_s = 0.0, swivel_delay_s = 0.0, tension_delay_s = 0.0;
  // Maps from the sensor to the log
  CableVector length_sign, swivel_sign, length_factor, swivel_factor, tension_factor;
  std::vector<int> cable_order;  ///< reading i is that of this cable
  double attitude_factor = 1.0;
  Vector3 attitude_sign = Vector3::Ones();

  /// Tension at the load cell [N] from that of the strand.
  [[nodiscard]] double load_cell_side_N(double strand_N, const CableRun& run) const;
  /// By how much each pulley's place gives way, a newton of pull.
  [[nodiscard]] double give_m_N(double time_s) const {
    return frame_compliance_m_N + frame_creep_m_N * std::log10(1.0 + time_s / 30.0);
  }
  [[nodiscard]] bool gives_way() const { return frame_compliance_m_N + frame_creep_m_N > 0.0; }
};

inline double changed(const std::vector<CableChange>& effects, double value, int cable,
                      double time_s) {
  for (const CableChange& effect : effects) value = effect(value, cable, time_s);
  return value;
}

/// The values of one expanded effect, taken in order.
class PlantValues {
 public:
  PlantValues(const std::vector<double>& values, int cables) : values_(values), cables_(cables) {}
  double scalar() { return values_[next_++]; }
  int cable() { return static_cast<int>(scalar()) - 1; }
  Vector3 vector3() {
    const double x = scalar(), y = scalar(), z = scalar();
    return {x, y, z};
  }
  CableVector per_cable() {
    CableVector out(cables_);
    for (double& v : out) v = scalar();
    return out;
  }

 private:
  const std::vector<double>& values_;
  int cables_;
  std::size_t next_ = 0;
};

/// Throws InputError for impossible options and for effects that do not fit the robot.
PlantParameters plant_parameters(const Robot& robot, const SimulatorOptions& options);

}  // namespace cdprcal
