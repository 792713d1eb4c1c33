// The pulleys are all of quite another size than the robot file says: it has their diameters, half
// the radii, those of another type, or none. Lengths that are counted from somewhere hide most of
// that in the pose.
#include "cdprcal/effects/moved_radii.hpp"

namespace cdprcal {
namespace {

class PulleyDiameter final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "pulley_diameter",
        .equation = "r + dr in eqs 3-5, one dr for all",
        .parameters = {{.name = "radius_error_m",
                        .unit = "m",
                        .shape = ParameterShape::scalar,
                        .typical = 0.015,
                        .plausible = 0.06,
                        .of = Yardstick::pulley}},
        .scope = EffectScope::robot,
        .confused_with = {"pulley_radius", "transmission_ratio"},
        .sentence = "all pulleys are of another size than the robot file says",
        .remedy =
            "look whether the robot file has diameters for radii, and measure a pulley's "
            "groove with a caliper",
        .settle = "measure the groove diameter of one pulley with a caliper",
        .all_or_nothing = true};
    return info;
  }
  [[nodiscard]] bool moves_cables() const override { return true; }
  void apply(const EffectValues& radius_error_m, Robot& robot) const override {
    add_to_radii(EffectValues::Constant(robot.cable_count(), radius_error_m[0]), robot);
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    Eigen::MatrixXd by_radius = Eigen::MatrixXd::Zero(out.rows(), context.state.cable_count);
    columns_of_pulley_radii(context, by_radius);
    out = by_radius.rowwise().sum();
  }
};

}  // namespace

std::shared_ptr<const Effect> pulley_diameter() { return std::make_shared<PulleyDiameter>(); }

}  // namespace cdprcal
