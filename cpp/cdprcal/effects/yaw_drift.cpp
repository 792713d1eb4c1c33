// The heading reading wanders with time.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class YawDrift final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "yaw_drift",
        .equation = "chi* = chi + rate t",
        .parameters = {{.name = "rate_rad_s",
                        .unit = "rad/s",
                        .shape = ParameterShape::scalar,
                        .typical = 2.5e-4,
                        .plausible = 1.3e-3}},
        .scope = EffectScope::run,
        .confused_with = {"magnetic_disturbance"},
        .sentence = "the yaw reading drifts with time",
        .remedy = "let the gyroscopes settle, or enter the rate",
        .settle = "visit the poses in random order: place and time come apart"};
    return info;
  }
  void add_to_readings(const EffectContext& context, const EffectValues& rate_rad_s,
                       PoseEvaluation& evaluation) const override {
    evaluation.roll_pitch_yaw_rad[2] += rate_rad_s[0] * context.measurement.run_time_s;
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    out(rows.attitude() + 2, 0) = context.measurement.run_time_s;
  }
};

}  // namespace

std::shared_ptr<const Effect> yaw_drift() { return std::make_shared<YawDrift>(); }

}  // namespace cdprcal
