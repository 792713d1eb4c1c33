// The centre of mass is not where the robot file says.
#include "cdprcal/effects/effect.hpp"
#include "cdprcal/statics/inertial_wrench.hpp"

namespace cdprcal {
namespace {

class CentreOfMass final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "centre_of_mass",
        .equation = "s' + ds",
        .parameters = {{.name = "offset_m",
                        .unit = "m",
                        .shape = ParameterShape::vector3,
                        .typical = 0.008,
                        .plausible = 0.06,
                        .of = Yardstick::platform}},
        .scope = EffectScope::robot,
        .confused_with = {"platform_anchors", "ahrs_misalignment"},
        .sentence = "the platform's centre of mass is elsewhere than the robot file says",
        .remedy = "correct the centre of mass in the robot file, or move the payload",
        .settle =
            "level the platform with a spirit level: that tells the mounting of the AHRS from the centre of mass"};
    return info;
  }
  void apply(const EffectValues& offset_m, Robot& robot) const override {
    robot.platform.centre_of_mass_m += offset_m;
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    const Measurement& m = context.measurement;
    const Vector3& arm = context.state.centre_of_mass_arm_m;
    const double mass_kg = context.robot.platform.mass_kg;
    const Vector3 force_N = mass_kg * centre_acceleration_m_s2(arm, m.twist, m.acceleration) -
                            context.robot.gravity_force_N();
    const Matrix3 force_by_arm = mass_kg * centre_acceleration_by_arm(m.twist, m.acceleration);
    out.middleRows<3>(rows.wrench()) = force_by_arm * context.state.rotation;
    out.middleRows<3>(rows.wrench() + 3) =
        (skew(arm) * force_by_arm - skew(force_N)) * context.state.rotation;
  }
};

}  // namespace

std::shared_ptr<const Effect> centre_of_mass() { return std::make_shared<CentreOfMass>(); }

}  // namespace cdprcal
