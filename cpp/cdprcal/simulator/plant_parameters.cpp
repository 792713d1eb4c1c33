#include "cdprcal/simulator/plant_parameters.hpp"

#include <algorithm>

#include "cdprcal/error.hpp"
#include "cdprcal/geometry/pose.hpp"

namespace cdprcal {
namespace {

/// The values of one expanded effect, taken in order.
class Values {
 public:
  Values(const InjectedEffect& effect, int cables) : values_(effect.values), cables_(cables) {}
  double scalar() { return values_[next_++]; }
  Vector3 vector3() {
    const double x = scalar(), y = scalar(), z = scalar();
    return {x, y, z};
  }
  CableVector per_cable() {
    CableVector out(cables_);
    for (double& v : out) v = scalar();
    return out;
  }
  PlantEvent event(PlantEvent::Kind kind) {
    const double time_s = scalar();
    const int cable = static_cast<int>(scalar()) - 1;
    return {kind, time_s, cable, scalar()};
  }

 private:
  const std::vector<double>& values_;
  int cables_;
  std::size_t next_ = 0;
};

void inject(const InjectedEffect& effect, PlantParameters& p) {
  const int n = p.robot.cable_count();
  Values v(effect, n);
  const std::string& name = effect.name;
  if (name == "transmission_ratio")
    p.ratio_error += v.per_cable();
  else if (name == "cable_elasticity")
    p.axial_stiffness_N = v.scalar();
  else if (name == "cable_creep")
    p.creep_m += v.scalar();
  else if (name == "cable_sag")
    p.linear_density_kg_m += v.scalar();
  else if (name == "pulley_friction")
    p.friction += v.scalar();
  else if (name == "bending_hysteresis")
    p.hysteresis_N += v.scalar(), p.hysteresis += v.scalar();
  else if (name == "swivel_hysteresis")
    p.swivel_half_width_rad += v.scalar();
  else if (name == "swivel_scale")
    p.swivel_scale += v.per_cable();
  else if (name == "pulley_radius") {
    for (Cable& cable : p.robot.cables) {
      cable.pulley.radius_m += v.scalar();
      if (cable.pulley.radius_m < 0.0)
        throw InputError("effect pulley_radius: leaves a radius below 0; give a smaller one");
    }
  } else if (name == "frame_anchors") {
    for (Cable& cable : p.robot.cables) cable.pulley.position_m += v.vector3();
  } else if (name == "platform_anchors") {
    for (Cable& cable : p.robot.cables) cable.platform_anchor_m += v.vector3();
  } else if (name == "load_cell_bias")
    p.load_cell_bias_N += v.per_cable();
  else if (name == "load_cell_gain")
    p.load_cell_gain += v.per_cable();
  else if (name == "load_cell_drift")
    p.load_cell_drift_N_s += v.scalar();
  else if (name == "mass") {
    p.robot.platform.mass_kg += v.scalar();
    if (!(p.robot.platform.mass_kg > 0.0))
      throw InputError("effect mass: leaves no mass; give a smaller one");
  } else if (name == "centre_of_mass")
    p.robot.platform.centre_of_mass_m += v.vector3();
  else if (name == "external_force")
    p.external_force_N += v.vector3();
  else if (name == "ahrs_misalignment")
    p.ahrs_rotation = p.ahrs_rotation * exp_so3(v.vector3());
  else if (name == "yaw_drift")
    p.yaw_drift_rad_s += v.scalar();
  else if (name == "magnetic_disturbance")
    p.magnetic_rad_m += v.vector3();
  else if (name == "sensor_delay")
    p.attitude_delay_s += v.scalar();
  else if (name == "length_sign")
    p.length_sign.array() *= v.per_cable().array();
  else if (name == "swivel_sign")
    p.swivel_sign.array() *= v.per_cable().array();
  else if (name == "cable_order") {
    for (int& cable : p.cable_order) cable = static_cast<int>(v.scalar()) - 1;
  } else if (name == "angle_unit")
    p.swivel_factor *= v.scalar(), p.attitude_factor *= v.scalar();
  else if (name == "length_unit")
    p.length_factor *= v.scalar();
  else if (name == "euler_convention")
    p.euler_convention = static_cast<EulerConvention>(static_cast<int>(v.scalar()));
  else if (name == "slack")
    p.events.push_back(v.event(PlantEvent::Kind::slack));
  else if (name == "outlier")
    p.events.push_back(v.event(PlantEvent::Kind::outlier));
  else if (name == "oscillation")
    p.events.push_back(v.event(PlantEvent::Kind::oscillation));
  else if (name == "cable_slip")
    p.events.push_back(v.event(PlantEvent::Kind::cable_slip));
  else if (name == "bent_frame_under_load")
    p.frame_compliance_m_N += v.scalar();
  else if (name == "temperature_step")
    p.warming_time_s = v.scalar(), p.warming_K += v.scalar();
  else if (name == "drum_runout")
    p.runout_m += v.scalar(), p.drum_circumference_m = v.scalar();
  else
    throw InputError("effect " + name + ": it is in the table but not in the plant; report it");
}

/// A known effect of the robot file in the plant's terms. For orders and units the file has what
/// corrects a reading and the plant what spoils it: the inverse.
InjectedEffect as_injected(const AppliedEffect& known) {
  InjectedEffect effect{known.name, {}};
  if (known.name == "cable_order") {
    const std::vector<double>& order = known.parameters.front().values;
    effect.values.resize(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      effect.values[static_cast<std::size_t>(order[i]) - 1] = static_cast<double>(i + 1);
    }
    return effect;
  }
  const bool unit = known.name == "length_unit" || known.name == "angle_unit";
  for (const AppliedEffect::Parameter& parameter : known.parameters) {
    for (const double v : parameter.values) effect.values.push_back(unit ? 1.0 / v : v);
  }
  return effect;
}

void check(const SimulatorOptions& options) {
  const auto require = [](bool fine, const char* what) {
    if (!fine) throw InputError(std::string("simulator options: ") + what);
  };
  require(options.step_s > 0.0 && options.step_s <= 0.01, "step_s must be in (0, 0.01]");
  require(options.strand.axial_stiffness_N > 0.0, "strand.axial_stiffness_N must be positive");
  require(options.strand.damping_ratio >= 0.0, "strand.damping_ratio must not be negative");
  require(options.damping.translation_decay_s > 0.0 && options.damping.rotation_decay_s > 0.0,
          "damping decay times must be positive (infinity: none)");
  require(options.winch.time_constant_s >= 0.0 && options.winch.max_velocity_m_s > 0.0 &&
              options.winch.drum_radius_m > 0.0 && options.winch.drum_inertia_kg_m2 > 0.0 &&
              options.winch.drum_damping_Nms >= 0.0 && options.winch.tension_gain_m_s_N >= 0.0 &&
              options.winch.tension_noise_N >= 0.0,
          "winch values must be positive");
  const SensorOptions& s = options.sensors;
  for (const SensorChannel* c :
       {&s.length_m, &s.swivel_rad, &s.tension_N, &s.roll_pitch_rad, &s.yaw_rad}) {
    require(c->noise >= 0.0 && c->resolution >= 0.0 && c->delay_s >= 0.0 && c->rate_Hz > 0.0 &&
                std::isfinite(c->bias),
            "sensor noise, resolution and delay must not be negative, rates must be positive");
    require(c->delay_s <= 2.0, "a sensor delay must be at most 2 s");
  }
}

}  // namespace

SensorOptions perfect_sensors() {
  SensorOptions perfect;
  perfect.length_m = perfect.swivel_rad = perfect.tension_N = perfect.roll_pitch_rad =
      perfect.yaw_rad = {};
  perfect.random_offsets = false;
  return perfect;
}

PlantParameters plant_parameters(const Robot& robot, const SimulatorOptions& options) {
  check(options);
  PlantParameters p;
  p.robot = robot;
  finalise(p.robot);
  const int n = robot.cable_count();
  p.axial_stiffness_N = options.strand.axial_stiffness_N;
  p.strand_damping_ratio = options.strand.damping_ratio;
  for (CableVector* zeros :
       {&p.ratio_error, &p.load_cell_gain, &p.load_cell_bias_N, &p.swivel_scale}) {
    zeros->setZero(n);
  }
  p.length_sign.setOnes(n);
  p.swivel_sign.setOnes(n);
  for (int i = 0; i < n; ++i) p.cable_order.push_back(i);
  p.euler_convention = robot.euler_convention;
  // Effects that the robot file lists for every run act in the plant, unless the options give the
  // same effect other values. Those of single runs do not.
  for (const AppliedEffect& known : robot.effects) {
    const bool replaced =
        std::any_of(options.effects.begin(), options.effects.end(),
                    [&](const InjectedEffect& other) { return other.name == known.name; });
    if (known.run.empty() && !replaced) inject(expanded(as_injected(known), n), p);
  }
  p.robot.effects.clear();
  for (const InjectedEffect& effect : options.effects) inject(expanded(effect, n), p);
  if (p.attitude_delay_s > 2.0) throw InputError("effect sensor_delay: must be at most 2 s");
  if (!(p.drum_circumference_m > 0.0))
    throw InputError("effect drum_runout: circumference_m must be positive");
  std::stable_sort(p.events.begin(), p.events.end(),
                   [](const PlantEvent& a, const PlantEvent& b) { return a.time_s < b.time_s; });
  return p;
}

double PlantParameters::grown_m(double time_s, double paid_out_m) const {
  double grown = 0.0;
  if (creep_m != 0.0) grown += creep_m * std::log10(1.0 + time_s / 30.0);
  if (warming_K != 0.0 && time_s > warming_time_s) {
    constexpr double kExpansion_1_K = 1.2e-5, kWarming_s = 20.0;  // steel
    grown += paid_out_m * kExpansion_1_K * warming_K *
             -std::expm1(-(time_s - warming_time_s) / kWarming_s);
  }
  return grown;
}

double PlantParameters::warm_zero_N(double time_s) const {
  if (warming_K == 0.0 || time_s <= warming_time_s) return 0.0;
  constexpr double kZero_N_K = 0.2, kWarming_s = 20.0;  // 0.02 % of 1 kN a kelvin
  return kZero_N_K * warming_K * -std::expm1(-(time_s - warming_time_s) / kWarming_s);
}

double PlantParameters::load_cell_side_N(double strand_N, double direction) const {
  return std::max(0.0, strand_N * std::exp(-direction * friction) -
                           direction * (hysteresis_N + hysteresis * strand_N));
}

}  // namespace cdprcal
