// The pulleys are not quite as large as the robot file says.
#include "cdprcal/effects/moved_radii.hpp"

namespace cdprcal {
namespace {

class PulleyRadius final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "pulley_radius",
        .equation = "r + dr in eqs 3-5",
        .parameters = {{.name = "radius_error_m",
                        .unit = "m",
                        .shape = ParameterShape::per_cable,
                        .typical = 0.0003,
                        .plausible = 0.0015,
                        .of = Yardstick::pulley}},
        .scope = EffectScope::robot,
        .confused_with = {"frame_anchors", "transmission_ratio", "pulley_diameter"},
        .sentence = "a pulley radius is wrong",
        .remedy = "measure the groove diameter with a caliper",
        .settle = "measure the groove diameter with a caliper"};
    return info;
  }
  [[nodiscard]] bool moves_cables() const override { return true; }
  void apply(const EffectValues& radius_error_m, Robot& robot) const override {
    add_to_radii(radius_error_m, robot);
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    columns_of_pulley_radii(context, out);
  }
};

}  // namespace

std::shared_ptr<const Effect> pulley_radius() { return std::make_shared<PulleyRadius>(); }

}  // namespace cdprcal
