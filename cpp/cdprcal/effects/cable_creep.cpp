// Loaded fibre cables grow longer with the logarithm of time.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class CableCreep final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "cable_creep",
        .equation = "dl* -= c log10(1 + t / 30 s)",
        .parameters = {{.name = "amplitude_m",
                        .unit = "m",
                        .shape = ParameterShape::scalar,
                        .typical = 0.002,
                        .plausible = 0.015,
                        .of = Yardstick::frame}},
        .scope = EffectScope::run,
        .confused_with = {"cable_elasticity", "yaw_drift"},
        .sentence = "the cables creep: they grow longer under load as time passes",
        .remedy = "preload the cables before the run, or enter the amplitude a decade of time",
        .settle = "visit the same poses again in another order",
        .one_sided = true};
    return info;
  }
  void add_to_readings(const EffectContext& context, const EffectValues& amplitude_m,
                       PoseEvaluation& evaluation) const override {
    evaluation.length_m.array() -= amplitude_m[0] * decades(context);
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    out.col(0).segment(rows.length(), rows.cables).setConstant(-decades(context));
  }

 private:
  static double decades(const EffectContext& context) {
    constexpr double kOnset_s = 30.0;
    return std::log10(1.0 + std::max(0.0, context.measurement.run_time_s) / kOnset_s);
  }
};

}  // namespace

std::shared_ptr<const Effect> cable_creep() { return std::make_shared<CableCreep>(); }

}  // namespace cdprcal
