// Bending a cable round its pulleys costs force, in the direction of motion.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class BendingHysteresis final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "bending_hysteresis",
        .equation = "tau* = tau - s (f0 + f1 tau)",
        .parameters = {{.name = "force_N",
                        .unit = "N",
                        .shape = ParameterShape::scalar,
                        .typical = 1.5,
                        .plausible = 8.0,
                        .of = Yardstick::weight},
                       {.name = "coefficient",
                        .unit = "1",
                        .shape = ParameterShape::scalar,
                        .typical = 0.01,
                        .plausible = 0.08}},
        .scope = EffectScope::robot,
        .confused_with = {"pulley_friction"},
        .sentence =
            "bending the cables over the pulleys costs force that changes sign with the motion",
        .remedy = "use larger pulleys or suppler cable, or enter the values",
        .settle = "approach the same pose from both directions, at low and at high tension",
        .one_sided = true};
    return info;
  }
  void correct_tension(const EffectContext& context, const EffectValues& values,
                       CableVector& tension_N) const override {
    for (int i = 0; i < context.state.cable_count; ++i) {
      const double s = value_or_zero(context.measurement.length_direction, i);
      const double measured = context.measurement.tension_N[i];
      tension_N[i] += (measured + s * values[0]) / (1.0 - s * values[1]) - measured;
    }
  }
  void columns(const EffectContext& context, const EffectValues& values,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    Eigen::MatrixXd by_value(rows.cables, 2);
    for (int i = 0; i < rows.cables; ++i) {
      const double s = value_or_zero(context.measurement.length_direction, i);
      const double keep = 1.0 - s * values[1];
      by_value(i, 0) = s / keep;
      by_value(i, 1) = s * (context.measurement.tension_N[i] + s * values[0]) / (keep * keep);
    }
    out.middleRows<6>(rows.wrench()) = wrench_by_tension(context.state, by_value);
  }
};

}  // namespace

std::shared_ptr<const Effect> bending_hysteresis() { return std::make_shared<BendingHysteresis>(); }

}  // namespace cdprcal
