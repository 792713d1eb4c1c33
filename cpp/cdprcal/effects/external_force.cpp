// Something pulls at the platform, always in the same direction of the world.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class ExternalForce final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "external_force",
        .equation = "f + F at the centre of mass",
        .parameters = {{.name = "force_N",
                        .unit = "N",
                        .shape = ParameterShape::vector3,
                        .typical = 4.0,
                        .plausible = 30.0,
                        .of = Yardstick::weight}},
        .scope = EffectScope::run,
        .confused_with = {"load_cell_bias", "mass"},
        .sentence = "something pulls at the platform: a hose, a wire, wind",
        .remedy = "find and free what pulls at the platform, or enter the force",
        .settle = "remove hoses and wires and repeat; weigh the platform for the vertical part"};
    return info;
  }
  void add_to_readings(const EffectContext& context, const EffectValues& force_N,
                       PoseEvaluation& evaluation) const override {
    const Vector3& arm = context.state.centre_of_mass_arm_m;
    evaluation.wrench.head<3>() -= force_N;
    evaluation.wrench.tail<3>() -= arm.cross(Vector3(force_N));
    evaluation.wrench_by_twist.bottomRightCorner<3, 3>() -= skew(force_N) * skew(arm);
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    out.middleRows<3>(rows.wrench()) = -Matrix3::Identity();
    out.middleRows<3>(rows.wrench() + 3) = -skew(context.state.centre_of_mass_arm_m);
  }
};

}  // namespace

std::shared_ptr<const Effect> external_force() { return std::make_shared<ExternalForce>(); }

}  // namespace cdprcal
