#include "cdprcal/simulator/plant_parameters.hpp"

#include <algorithm>

#include "cdprcal/error.hpp"
#include "cdprcal/model/yardstick.hpp"

namespace cdprcal {
namespace {

/// Of irma4: axial stiffness of its nominal cables, and noise inside its drives.
constexpr double kRigid_N = 1e7, kDriveNoise_N = 0.2;

void check(const SimulatorOptions& options) {
  const auto require = [](bool fine, const char* what) {
    if (!fine) throw InputError(std::string("simulator options: ") + what);
  };
  require(options.step_s > 0.0 && options.step_s <= 0.01, "step_s must be in (0, 0.01]");
  require(options.strand.axial_stiffness_N >= 0.0, "strand.axial_stiffness_N must not be negative");
  require(options.strand.damping_ratio >= 0.0, "strand.damping_ratio must not be negative");
  require(options.damping.translation_decay_s > 0.0 && options.damping.rotation_decay_s > 0.0,
          "damping decay times must be positive (infinity: none)");
  require(options.winch.time_constant_s >= 0.0 && options.winch.max_velocity_m_s > 0.0 &&
              options.winch.drum_radius_m > 0.0 && options.winch.drum_inertia_kg_m2 > 0.0 &&
              options.winch.drum_damping_Nms >= 0.0 && options.winch.tension_gain_m_s_N >= 0.0 &&
              !(options.winch.tension_noise_N < 0.0),
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
  perfect.specific_force_noise_m_s2 = perfect.specific_force_bias_m_s2 = 0.0;
  perfect.angular_velocity_noise_rad_s = perfect.angular_velocity_bias_rad_s = 0.0;
  perfect.random_offsets = false;
  return perfect;
}

PlantParameters plant_parameters(const Robot& robot, const SimulatorOptions& options) {
  check(options);
  PlantParameters p;
  p.robot = robot;
  finalise(p.robot);
  const int n = robot.cable_count();
  p.axial_stiffness_N = options.strand.axial_stiffness_N > 0.0
                            ? options.strand.axial_stiffness_N
                            : kRigid_N * times_reference(Yardstick::weight, robot);
  p.drive_noise_N = std::isnan(options.winch.tension_noise_N)
                        ? kDriveNoise_N * times_reference(Yardstick::weight, robot)
                        : options.winch.tension_noise_N;
  p.strand_damping_ratio = options.strand.damping_ratio;
  p.ratio_error.setZero(n);
  p.load_cell_gain.setZero(n);
  for (CableVector* one_each :
       {&p.length_sign, &p.swivel_sign, &p.length_factor, &p.swivel_factor, &p.tension_factor}) {
    one_each->setOnes(n);
  }
  for (int i = 0; i < n; ++i) p.cable_order.push_back(i);
  p.euler_convention = robot.euler_convention;
  // What the robot file says of the robot is so in the plant, unless the options say otherwise;
  // what a file says of one run is not.
  std::vector<InjectedEffect> acting;
  for (const AppliedEffect& known : robot.effects) {
    const bool replaced =
        std::any_of(options.effects.begin(), options.effects.end(),
                    [&](const InjectedEffect& other) { return other.name == known.name; });
    if (known.run.empty() && !replaced) acting.push_back(as_injected(known, robot.own_effects));
  }
  p.robot.effects.clear();
  acting.insert(acting.end(), options.effects.begin(), options.effects.end());
  for (InjectedEffect& effect : acting) effect = expanded(effect, n, robot.own_effects);
  for (const InjectableEffect& row : injectable_effects()) {
    if (is_own(row.name, robot.own_effects)) continue;
    for (const InjectedEffect& effect : acting) {
      if (effect.name != row.name) continue;
      PlantValues values(effect.values, n);
      row.act(values, p);
    }
  }
  for (const auto& own : robot.own_effects) {
    for (const InjectedEffect& effect : acting) {
      if (effect.name != own->name()) continue;
      const auto size = static_cast<Eigen::Index>(effect.values.size());
      p.written.push_back({own, Eigen::Map<const EffectValues>(effect.values.data(), size)});
      own->apply(p.written.back().values, p.robot);
    }
  }
  std::stable_sort(p.events.begin(), p.events.end(),
                   [](const PlantEvent& a, const PlantEvent& b) { return a.time_s < b.time_s; });
  return p;
}

double PlantParameters::load_cell_side_N(double strand_N, const CableRun& run) const {
  double load_N = strand_N;
  for (const auto& effect : to_load_cell_N) load_N = effect(load_N, strand_N, run);
  return std::max(0.0, load_N);
}

}  // namespace cdprcal
