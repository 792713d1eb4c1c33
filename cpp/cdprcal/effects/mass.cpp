// The platform is heavier or lighter than the robot file says.
#include "cdprcal/effects/effect.hpp"
#include "cdprcal/statics/inertial_wrench.hpp"

namespace cdprcal {
namespace {

class Mass final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "mass",
        .equation = "m + dm",
        .parameters = {{.name = "mass_error_kg",
                        .unit = "kg",
                        .shape = ParameterShape::scalar,
                        .typical = 0.7,
                        .plausible = 6.0,
                        .of = Yardstick::mass}},
        .scope = EffectScope::robot,
        .confused_with = {"load_cell_gain", "load_cell_bias", "external_force"},
        .sentence = "the platform does not weigh what the robot file says",
        .remedy = "weigh the platform and correct the robot file",
        .settle =
            "weigh the platform: mass, a common load-cell gain and a vertical force cannot be told apart from inside"};
    return info;
  }
  void apply(const EffectValues& mass_error_kg, Robot& robot) const override {
    robot.platform.mass_kg = std::max(kLeastMassShare * robot.platform.mass_kg,
                                      robot.platform.mass_kg + mass_error_kg[0]);
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    const Measurement& m = context.measurement;
    const Vector3& arm = context.state.centre_of_mass_arm_m;
    const Vector3 gravity(0.0, 0.0, -context.robot.gravity_m_s2);
    const Vector3 force = centre_acceleration_m_s2(arm, m.twist, m.acceleration) - gravity;
    out.col(0).segment<3>(rows.wrench()) = force;
    out.col(0).segment<3>(rows.wrench() + 3) = arm.cross(force);
  }
};

}  // namespace

std::shared_ptr<const Effect> mass() { return std::make_shared<Mass>(); }

}  // namespace cdprcal
