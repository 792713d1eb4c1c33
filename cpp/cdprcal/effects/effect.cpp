#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

int count(ParameterShape shape, int cables) {
  switch (shape) {
    case ParameterShape::scalar:
      return 1;
    case ParameterShape::per_cable:
      return cables;
    case ParameterShape::vector3:
      return 3;
    case ParameterShape::per_cable_vector3:
      return 3 * cables;
  }
  return 0;
}

EffectValues spread(const EffectInfo& info, int cables, double EffectParameter::* member) {
  EffectValues values;
  for (const EffectParameter& parameter : info.parameters) {
    const Eigen::Index before = values.size();
    values.conservativeResize(before + count(parameter.shape, cables));
    values.tail(values.size() - before).setConstant(parameter.*member);
  }
  return values;
}

}  // namespace

int Effect::size(int cables) const {
  int total = 0;
  for (const EffectParameter& parameter : info().parameters)
    total += count(parameter.shape, cables);
  return total;
}

EffectValues Effect::typical(int cables) const {
  return spread(info(), cables, &EffectParameter::typical);
}

EffectValues Effect::plausible(int cables) const {
  return spread(info(), cables, &EffectParameter::plausible);
}

Robot with_effects(const Robot& robot, const ActiveEffects& effects) {
  Robot changed = robot;
  for (const ActiveEffect& active : effects) active.effect->apply(active.values, changed);
  return changed;
}

}  // namespace cdprcal
