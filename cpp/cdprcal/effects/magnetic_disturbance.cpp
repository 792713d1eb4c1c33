// Iron bends the magnetic field: the heading reading depends on the place.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class MagneticDisturbance final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "magnetic_disturbance",
        .equation = "chi* = chi + m . p",
        .parameters = {{.name = "gradient_rad_m",
                        .unit = "rad/m",
                        .shape = ParameterShape::vector3,
                        .typical = 0.07,
                        .plausible = 0.6,
                        .of = Yardstick::gradient}},
        .scope = EffectScope::robot,
        .confused_with = {"yaw_drift"},
        .sentence = "the yaw reading depends on where the platform is: magnetic disturbance",
        .remedy = "switch the magnetometer off, or map the field",
        .settle = "visit the poses in random order: place and time come apart"};
    return info;
  }
  void add_to_readings(const EffectContext& context, const EffectValues& gradient_rad_m,
                       PoseEvaluation& evaluation) const override {
    evaluation.roll_pitch_yaw_rad[2] += gradient_rad_m.dot(context.pose.position_m);
    evaluation.attitude_by_twist.row(2).head<3>() += gradient_rad_m;
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    out.row(rows.attitude() + 2) = context.pose.position_m.transpose();
  }
};

}  // namespace

std::shared_ptr<const Effect> magnetic_disturbance() {
  return std::make_shared<MagneticDisturbance>();
}

}  // namespace cdprcal
