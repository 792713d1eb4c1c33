// Readings of one sensor arrive late, so that they lag behind the others while the platform moves.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

/// The attitude's has the name that was there first.
class Delay : public Effect {
 public:
  Delay(const char* name, const char* sentence, std::vector<const char*> confused_with)
      : info_{.name = name,
              .equation = "y*(t) = y(t - T)",
              .parameters = {{.name = "delay_s",
                              .unit = "s",
                              .shape = ParameterShape::scalar,
                              .typical = 0.08,
                              .plausible = 1.5,
                              .range = ValueRange::not_negative}},
              .scope = EffectScope::robot,
              .confused_with = std::move(confused_with),
              .sentence = sentence,
              .remedy = "correct the time stamps by the delay",
              .settle = "log at a higher rate while the platform swings",
              .one_sided = true,
              .of_lateness = true} {}
  const EffectInfo& info() const override { return info_; }
  /// In single samples between rests what has no name looks like it: friction, creep, play.
  Shows shows() const override { return Shows::in_moving_balance; }

 private:
  EffectInfo info_;
};

class AttitudeDelay final : public Delay {
 public:
  using Delay::Delay;
  Shows shows() const override { return Shows::in_motion; }
  void add_to_readings(const EffectContext& context, const EffectValues& delay_s,
                       PoseEvaluation& evaluation) const override {
    evaluation.roll_pitch_yaw_rad -= delay_s[0] * context.measurement.attitude_rate_rad_s;
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    out.col(0).segment<3>(rows.attitude()) = -context.measurement.attitude_rate_rad_s;
  }
};

/// Of lengths or swivels.
class CableDelay final : public Delay {
 public:
  struct Of {
    CableVector Measurement::* rate;
    CableVector PoseEvaluation::* reading;
    int (ReadingRows::*row)() const;
  };
  CableDelay(const Of& of, const char* name, const char* sentence,
             std::vector<const char*> confused_with)
      : Delay(name, sentence, std::move(confused_with)), of_(of) {}
  void add_to_readings(const EffectContext& context, const EffectValues& delay_s,
                       PoseEvaluation& evaluation) const override {
    const CableVector& rate = context.measurement.*of_.rate;
    if (rate.size() > 0) evaluation.*of_.reading -= delay_s[0] * rate;
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    const CableVector& rate = context.measurement.*of_.rate;
    if (rate.size() > 0) out.col(0).segment((rows.*of_.row)(), rows.cables) = -rate;
  }

 private:
  Of of_;
};

class TensionDelay final : public Delay {
 public:
  using Delay::Delay;
  void add_to_readings(const EffectContext& context, const EffectValues& delay_s,
                       PoseEvaluation& evaluation) const override {
    evaluation.wrench += delay_s[0] * context.measurement.rising_wrench;
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    out.col(0).segment<6>(rows.wrench()) = context.measurement.rising_wrench;
  }
};

}  // namespace

std::shared_ptr<const Effect> sensor_delay() {
  return std::make_shared<AttitudeDelay>(
      "sensor_delay", "the attitude readings arrive later than those of the drives",
      std::vector<const char*>{});
}

std::shared_ptr<const Effect> length_delay() {
  return std::make_shared<CableDelay>(
      CableDelay::Of{&Measurement::length_rate_m_s, &PoseEvaluation::length_m,
                     &ReadingRows::length},
      "length_delay", "the lengths arrive later than the readings of all other sensors",
      std::vector<const char*>{"sensor_delay", "swivel_delay"});
}

std::shared_ptr<const Effect> swivel_delay() {
  return std::make_shared<CableDelay>(
      CableDelay::Of{&Measurement::swivel_rate_rad_s, &PoseEvaluation::swivel_rad,
                     &ReadingRows::swivel},
      "swivel_delay", "the swivel angles arrive later than the readings of the drives",
      std::vector<const char*>{"swivel_hysteresis"});
}

std::shared_ptr<const Effect> tension_delay() {
  return std::make_shared<TensionDelay>("tension_delay",
                                        "the tensions arrive later than the other readings",
                                        std::vector<const char*>{"viscous_friction"});
}

}  // namespace cdprcal
