// A swivel lags behind its cable by a dead band.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class SwivelHysteresis final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{.name = "swivel_hysteresis",
                                 .equation = "sigma* = sigma - s_sigma delta",
                                 .parameters = {{.name = "half_width_rad",
                                                 .unit = "rad",
                                                 .shape = ParameterShape::scalar,
                                                 .typical = 0.008,
                                                 .plausible = 0.052,
                                                 .range = ValueRange::not_negative}},
                                 .scope = EffectScope::robot,
                                 .confused_with = {"swivel_scale"},
                                 .sentence = "the swivels stick and lag behind the cables",
                                 .remedy = "free the swivel bearings, or enter the half-width",
                                 .settle = "approach the same pose from both sides",
                                 .one_sided = true,
                                 .of_swivel_play = true};
    return info;
  }
  void add_to_readings(const EffectContext& context, const EffectValues& half_width_rad,
                       PoseEvaluation& evaluation) const override {
    for (int i = 0; i < context.state.cable_count; ++i) {
      evaluation.swivel_rad[i] -=
          value_or_zero(context.measurement.swivel_direction, i) * half_width_rad[0];
    }
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    for (int i = 0; i < rows.cables; ++i)
      out(rows.swivel() + i, 0) = -value_or_zero(context.measurement.swivel_direction, i);
  }
};

}  // namespace

std::shared_ptr<const Effect> swivel_hysteresis() { return std::make_shared<SwivelHysteresis>(); }

}  // namespace cdprcal
