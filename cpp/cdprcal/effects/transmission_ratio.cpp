// Each winch pays out a little more or less than its encoder counts say.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class TransmissionRatio final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "transmission_ratio",
        .equation = "dl* = (1 + kappa_i) dl",
        .parameters = {{.name = "ratio_error",
                        .unit = "1",
                        .shape = ParameterShape::per_cable,
                        .typical = 0.015,
                        .plausible = 0.09,
                        .range = ValueRange::above_minus_one}},
        .scope = EffectScope::robot,
        .confused_with = {"frame_anchors", "cable_elasticity"},
        .sentence =
            "a winch turns its encoder counts into a wrong length: drum diameter or gear ratio",
        .remedy = "correct the counts-per-metre of the named winches",
        .settle =
            "measure one cable length change by tape: it fixes the common part, which the frame scale mimics",
        .of_one_make = true};
    return info;
  }
  void add_to_readings(const EffectContext& context, const EffectValues& ratio_error,
                       PoseEvaluation& evaluation) const override {
    for (int i = 0; i < context.state.cable_count; ++i) {
      evaluation.length_m[i] += ratio_error[i] * context.state.cable[i].length_m;
    }
    evaluation.length_by_twist += ratio_error.asDiagonal() * length_jacobian(context.state);
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    for (int i = 0; i < rows.cables; ++i) {
      out(rows.length() + i, i) = context.state.cable[i].length_m;
    }
  }
};

}  // namespace

std::shared_ptr<const Effect> transmission_ratio() { return std::make_shared<TransmissionRatio>(); }

}  // namespace cdprcal
