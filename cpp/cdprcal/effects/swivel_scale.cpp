// A swivel encoder counts a little more or less than it turns.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class SwivelScale final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{.name = "swivel_scale",
                                 .equation = "sigma* = (1 + g_i) sigma",
                                 .parameters = {{.name = "scale_error",
                                                 .unit = "1",
                                                 .shape = ParameterShape::per_cable,
                                                 .typical = 0.03,
                                                 .plausible = 0.15,
                                                 .range = ValueRange::above_minus_one}},
                                 .scope = EffectScope::robot,
                                 .confused_with = {"transmission_ratio", "frame_anchors"},
                                 .sentence = "a swivel encoder has a wrong scale",
                                 .remedy = "correct the counts-per-turn of the named swivels",
                                 .settle = "turn a swivel by a known angle"};
    return info;
  }
  void add_to_readings(const EffectContext& context, const EffectValues& scale_error,
                       PoseEvaluation& evaluation) const override {
    for (int i = 0; i < context.state.cable_count; ++i) {
      evaluation.swivel_rad[i] += scale_error[i] * context.state.cable[i].swivel_rad;
    }
    evaluation.swivel_by_twist += scale_error.asDiagonal() * swivel_jacobian(context.state);
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    for (int i = 0; i < rows.cables; ++i) {
      out(rows.swivel() + i, i) = context.state.cable[i].swivel_rad;
    }
  }
};

}  // namespace

std::shared_ptr<const Effect> swivel_scale() { return std::make_shared<SwivelScale>(); }

}  // namespace cdprcal
