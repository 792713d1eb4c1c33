// The pulleys are not quite as large as the robot file says.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class PulleyRadius final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{.name = "pulley_radius",
                                 .equation = "r + dr in eqs 3-5",
                                 .parameters = {{.name = "radius_error_m",
                                                 .unit = "m",
                                                 .shape = ParameterShape::per_cable,
                                                 .typical = 0.0003,
                                                 .plausible = 0.0015,
                                                 .of = Yardstick::pulley}},
                                 .scope = EffectScope::robot,
                                 .confused_with = {"frame_anchors", "transmission_ratio"},
                                 .sentence = "a pulley radius is wrong",
                                 .remedy = "measure the groove diameter with a caliper",
                                 .settle = "measure the groove diameter with a caliper"};
    return info;
  }
  [[nodiscard]] bool moves_cables() const override { return true; }
  void apply(const EffectValues& radius_error_m, Robot& robot) const override {
    for (int i = 0; i < robot.cable_count(); ++i) {
      double& radius_m = robot.cables[i].pulley.radius_m;
      radius_m = std::max(0.0, radius_m + radius_error_m[i]);
    }
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    for (int i = 0; i < rows.cables; ++i) {
      const CableDerivatives d =
          cable_derivatives(context.robot.cables[i].pulley, context.state.cable[i]);
      out(rows.length() + i, i) = d.length_by_radius;
      const Vector3 force = context.tension_N[i] * d.direction_by_radius;
      out.col(i).segment<3>(rows.wrench()) = force;
      out.col(i).segment<3>(rows.wrench() + 3) = context.state.anchor_arm_m[i].cross(force);
    }
  }
};

}  // namespace

std::shared_ptr<const Effect> pulley_radius() { return std::make_shared<PulleyRadius>(); }

}  // namespace cdprcal
