// The attitude arrives late, so that it lags behind the cables while the platform moves.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class SensorDelay final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "sensor_delay",
        .equation = "y*(t) = y(t - T)",
        .parameters = {{.name = "delay_s",
                        .unit = "s",
                        .shape = ParameterShape::scalar,
                        .typical = 0.08,
                        .plausible = 1.5,
                        .range = ValueRange::not_negative}},
        .scope = EffectScope::robot,
        .confused_with = {},
        .sentence = "the attitude readings arrive later than those of the drives",
        .remedy = "correct the time stamps by the delay",
        .settle = "log at a higher rate while the platform swings",
        .one_sided = true};
    return info;
  }
  void add_to_readings(const EffectContext& context, const EffectValues& delay_s,
                       PoseEvaluation& evaluation) const override {
    evaluation.roll_pitch_yaw_rad -= delay_s[0] * context.measurement.attitude_rate_rad_s;
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    out.col(0).segment<3>(rows.attitude()) = -context.measurement.attitude_rate_rad_s;
  }
  Shows shows() const override { return Shows::in_motion; }
};

}  // namespace

std::shared_ptr<const Effect> sensor_delay() { return std::make_shared<SensorDelay>(); }

}  // namespace cdprcal
