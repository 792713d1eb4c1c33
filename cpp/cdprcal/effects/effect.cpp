#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

EffectValues spread(const EffectInfo& info, const Robot& robot, double EffectParameter::* member) {
  EffectValues values;
  for (const EffectParameter& parameter : info.parameters) {
    const Eigen::Index before = values.size();
    values.conservativeResize(before + entries(parameter.shape, robot.cable_count()));
    values.tail(values.size() - before)
        .setConstant(parameter.*member * times_reference(parameter.of, robot));
  }
  return values;
}

}  // namespace

int Effect::size(int cables) const {
  int total = 0;
  for (const EffectParameter& p : info().parameters) total += entries(p.shape, cables);
  return total;
}

EffectValues Effect::typical(const Robot& robot) const {
  const EffectValues of_robots = spread(info(), robot, &EffectParameter::typical);
  const EffectValues stated = stated_sigma(robot);
  if (stated.size() == 0) return of_robots;
  return stated.array().isFinite().select(stated, of_robots);
}

EffectValues Effect::plausible(const Robot& robot) const {
  const EffectValues of_robots = spread(info(), robot, &EffectParameter::plausible);
  const EffectValues stated = stated_sigma(robot);
  if (stated.size() == 0) return of_robots;
  // As many σ as of robots like it, if that is more.
  const EffectValues sigmas =
      of_robots.cwiseQuotient(spread(info(), robot, &EffectParameter::typical));
  return stated.array().isFinite().select(of_robots.cwiseMax(sigmas.cwiseProduct(stated)),
                                          of_robots);
}

bool Effect::is_stated(const Robot& robot) const {
  return stated_sigma(robot).array().isFinite().any();
}

EffectValues Effect::to_reported(const EffectValues& values) const {
  return info().inverse ? EffectValues(values.cwiseInverse()) : values;
}

EffectValues Effect::reported_deviation(const EffectValues& values,
                                        const EffectValues& deviation) const {
  return info().inverse ? EffectValues(deviation.array() / values.array().square()) : deviation;
}

CableVector corrected_tension_N(const EffectContext& context, const ActiveEffects& effects,
                                const CableVector& reading_N) {
  CableVector out = reading_N;
  for (const ActiveEffect& active : effects) {
    active.effect->correct_tension(context, active.values, out);
  }
  return out;
}

Robot with_effects(const Robot& robot, const ActiveEffects& effects) {
  Robot changed = robot;
  for (const ActiveEffect& active : effects) active.effect->apply(active.values, changed);
  return changed;
}

Eigen::MatrixXd wrench_by_tension(const PlatformState& state,
                                  const Eigen::MatrixXd& tension_by_value) {
  return structure_matrix(state) *
         tension_by_value.array().isNaN().select(0.0, tension_by_value).matrix();
}

}  // namespace cdprcal
