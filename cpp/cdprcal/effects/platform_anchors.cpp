// The cables are not anchored on the platform quite where the robot file says.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class PlatformAnchors final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "platform_anchors",
        .equation = "a' + da",
        .parameters = {{.name = "offset_m",
                        .unit = "m",
                        .shape = ParameterShape::per_cable_vector3,
                        .typical = 0.0015,
                        .plausible = 0.009,
                        .of = Yardstick::platform}},
        .scope = EffectScope::robot,
        .confused_with = {"centre_of_mass", "frame_anchors"},
        .sentence = "a cable is anchored elsewhere on the platform than the robot file says",
        .remedy = "measure the platform anchors again and correct the robot file",
        .settle =
            "hang the platform by one anchor: the vertical through it passes the centre of mass"};
    return info;
  }
  [[nodiscard]] bool moves_cables() const override { return true; }
  void apply(const EffectValues& offset_m, Robot& robot) const override {
    for (int i = 0; i < robot.cable_count(); ++i) {
      robot.cables[i].platform_anchor_m += offset_m.segment<3>(3 * i);
    }
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    const Matrix3& rotation = context.state.rotation;
    for (int i = 0; i < rows.cables; ++i) {
      const CableState& cable = context.state.cable[i];
      out.row(rows.length() + i).segment<3>(3 * i) = cable.direction.transpose() * rotation;
      out.row(rows.swivel() + i).segment<3>(3 * i) = swivel_by_q(cable).transpose() * rotation;
      const double tension_N = context.tension_N[i];
      const Matrix3 force = tension_N * direction_by_q(cable) * rotation;
      out.block<3, 3>(rows.wrench(), 3 * i) = force;
      out.block<3, 3>(rows.wrench() + 3, 3 * i) = skew(context.state.anchor_arm_m[i]) * force -
                                                  tension_N * skew(cable.direction) * rotation;
    }
  }
};

}  // namespace

std::shared_ptr<const Effect> platform_anchors() { return std::make_shared<PlatformAnchors>(); }

}  // namespace cdprcal
