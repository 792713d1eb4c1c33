// A turning pulley takes a share of the tension, in the direction of motion.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class PulleyFriction final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "pulley_friction",
        .equation = "tau* = tau exp(-s mu)",
        .parameters = {{.name = "coefficient",
                        .unit = "1",
                        .shape = ParameterShape::scalar,
                        .typical = 0.025,
                        .plausible = 0.15,
                        .range = ValueRange::not_negative}},
        .scope = EffectScope::robot,
        .confused_with = {"bending_hysteresis"},
        .sentence =
            "the pulleys rub: the load cells read less when the cable pays out than when it is hauled in",
        .remedy = "lubricate or replace the pulley bearings, or enter the coefficient",
        .settle = "approach the same pose from both directions",
        .one_sided = true};
    return info;
  }
  void correct_tension(const EffectContext& context, const EffectValues& coefficient,
                       CableVector& tension_N) const override {
    for (int i = 0; i < context.state.cable_count; ++i) {
      tension_N[i] +=
          context.measurement.tension_N[i] *
          std::expm1(value_or_zero(context.measurement.length_direction, i) * coefficient[0]);
    }
  }
  void columns(const EffectContext& context, const EffectValues& coefficient,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    Eigen::VectorXd by_value(rows.cables);
    for (int i = 0; i < rows.cables; ++i) {
      const double s = value_or_zero(context.measurement.length_direction, i);
      by_value[i] = s * context.measurement.tension_N[i] * std::exp(s * coefficient[0]);
    }
    out.middleRows<6>(rows.wrench()) = wrench_by_tension(context.state, by_value);
  }
};

}  // namespace

std::shared_ptr<const Effect> pulley_friction() { return std::make_shared<PulleyFriction>(); }

}  // namespace cdprcal
