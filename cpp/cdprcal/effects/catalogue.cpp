#include "cdprcal/effects/catalogue.hpp"

#include "cdprcal/error.hpp"

namespace cdprcal {

using EffectPointer = std::shared_ptr<const Effect>;

EffectPointer transmission_ratio(), cable_elasticity(), cable_creep(), cable_sag(),
    pulley_friction(), bending_hysteresis(), swivel_hysteresis(), swivel_scale(), pulley_radius(),
    frame_anchors(), platform_anchors(), load_cell_bias(), load_cell_gain(), load_cell_drift(),
    mass(), centre_of_mass(), external_force(), ahrs_misalignment(), yaw_drift(),
    magnetic_disturbance(), sensor_delay();

const std::vector<EffectPointer>& effect_catalogue() {
  static const std::vector<EffectPointer> catalogue{
      transmission_ratio(), cable_elasticity(),     cable_creep(),
      cable_sag(),          pulley_friction(),      bending_hysteresis(),
      swivel_hysteresis(),  swivel_scale(),         pulley_radius(),
      frame_anchors(),      platform_anchors(),     load_cell_bias(),
      load_cell_gain(),     load_cell_drift(),      mass(),
      centre_of_mass(),     external_force(),       ahrs_misalignment(),
      yaw_drift(),          magnetic_disturbance(), sensor_delay()};
  return catalogue;
}

EffectPointer find_effect(const std::string& name) {
  std::string known;
  for (const EffectPointer& effect : effect_catalogue()) {
    if (effect->name() == name) return effect;
    known += (known.empty() ? "" : ", ") + effect->name();
  }
  throw InputError("effect: '" + name + "' is not known; give one of " + known);
}

}  // namespace cdprcal
