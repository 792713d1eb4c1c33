// The pulleys are not quite where the robot file says.
#include "cdprcal/effects/moved_pulleys.hpp"

namespace cdprcal {
namespace {

class FrameAnchors final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "frame_anchors",
        .equation = "d + dd",
        .parameters = {{.name = "offset_m",
                        .unit = "m",
                        .shape = ParameterShape::per_cable_vector3,
                        .typical = 0.002,
                        .plausible = 0.015,
                        .of = Yardstick::frame}},
        .scope = EffectScope::robot,
        .confused_with = {"transmission_ratio", "platform_anchors", "pulley_radius", "frame_scale",
                          "frame_shear", "frame_warp"},
        .sentence = "a pulley sits elsewhere on the frame than the robot file says",
        .remedy = "measure the pulley positions again and correct the robot file",
        .settle = "measure the distances between the pulleys by tape"};
    return info;
  }
  [[nodiscard]] bool moves_cables() const override { return true; }
  [[nodiscard]] EffectValues stated_sigma(const Robot& robot) const override {
    EffectValues out(3L * robot.cable_count());
    for (int i = 0; i < robot.cable_count(); ++i) {
      out.segment<3>(3L * i) = robot.cables[i].pulley.position_sigma_m;
    }
    return out;
  }
  void apply(const EffectValues& offset_m, Robot& robot) const override {
    for (int i = 0; i < robot.cable_count(); ++i) {
      robot.cables[i].pulley.position_m += offset_m.segment<3>(3 * i);
    }
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    columns_of_pulley_places(context, out);
  }
};

}  // namespace

std::shared_ptr<const Effect> frame_anchors() { return std::make_shared<FrameAnchors>(); }

}  // namespace cdprcal
