#include "cdprcal/effects/catalogue.hpp"

#include <algorithm>

#include "cdprcal/error.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {

using EffectPointer = std::shared_ptr<const Effect>;

EffectPointer transmission_ratio(), cable_elasticity(), cable_creep(), cable_sag(),
    pulley_friction(), bending_hysteresis(), swivel_hysteresis(), swivel_scale(), pulley_radius(),
    pulley_diameter(), frame_anchors(), frame_scale(), frame_shear(), frame_warp(),
    platform_anchors(), load_cell_bias(), load_cell_gain(), load_cell_drift(), mass(),
    centre_of_mass(), external_force(), umbilical(), base_tilt(), ahrs_misalignment(),
    attitude_scale(), yaw_drift(), magnetic_disturbance(), sensor_delay(), length_delay(),
    swivel_delay(), tension_delay(), viscous_friction(), inertia();

const std::vector<EffectPointer>& effect_catalogue() {
  static const std::vector<EffectPointer> catalogue{transmission_ratio(),
                                                    cable_elasticity(),
                                                    cable_creep(),
                                                    cable_sag(),
                                                    pulley_friction(),
                                                    bending_hysteresis(),
                                                    swivel_hysteresis(),
                                                    swivel_scale(),
                                                    pulley_radius(),
                                                    pulley_diameter(),
                                                    frame_anchors(),
                                                    frame_scale(),
                                                    frame_shear(),
                                                    frame_warp(),
                                                    platform_anchors(),
                                                    load_cell_bias(),
                                                    load_cell_gain(),
                                                    load_cell_drift(),
                                                    mass(),
                                                    centre_of_mass(),
                                                    external_force(),
                                                    umbilical(),
                                                    base_tilt(),
                                                    ahrs_misalignment(),
                                                    attitude_scale(),
                                                    yaw_drift(),
                                                    magnetic_disturbance(),
                                                    sensor_delay(),
                                                    length_delay(),
                                                    swivel_delay(),
                                                    tension_delay(),
                                                    viscous_friction(),
                                                    inertia()};
  return catalogue;
}

std::vector<EffectPointer> effects_of(const Robot& robot) {
  if (std::ranges::find(robot.own_effects, nullptr) != robot.own_effects.end()) {
    throw InputError("own_effects: one of them is a null pointer; leave it out");
  }
  std::vector<EffectPointer> all = effect_catalogue();
  all.insert(all.end(), robot.own_effects.begin(), robot.own_effects.end());
  return all;
}

namespace {

EffectPointer find_among(const std::vector<EffectPointer>& effects, const std::string& name) {
  std::string known;
  for (const EffectPointer& effect : effects) {
    if (effect->info().name == name) return effect;
    add_item(known, effect->name());
  }
  throw InputError("effect: '" + name + "' is not known; give one of " + known);
}

}  // namespace

EffectPointer find_effect(const std::string& name) { return find_among(effect_catalogue(), name); }

EffectPointer find_effect(const Robot& robot, const std::string& name) {
  return find_among(effects_of(robot), name);
}

}  // namespace cdprcal
