// Cables stretch under their own tension; winches measure what they pay out unstretched.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

/// Internal value: the compliance 1/EA [1/N], whose zero is an inextensible cable.
class CableElasticity final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "cable_elasticity",
        .equation = "dl* = d[l / (1 + tau / EA)]",
        .parameters = {{.name = "axial_stiffness_N",
                        .unit = "N",
                        .shape = ParameterShape::scalar,
                        .typical = 1e-5,
                        .plausible = 1e-4,
                        .of = Yardstick::flexibility,
                        .range = ValueRange::positive}},
        .scope = EffectScope::robot,
        .confused_with = {"transmission_ratio", "cable_creep", "load_cell_gain"},
        .sentence = "the cables stretch under tension",
        .remedy = "enter the axial stiffness EA of the cables",
        .settle = "pull one cable against a fixed point and read its length change",
        .inverse = true,
        .one_sided = true};
    return info;
  }
  void add_to_readings(const EffectContext& context, const EffectValues& compliance,
                       PoseEvaluation& evaluation) const override {
    const CableJacobian by_twist = length_jacobian(context.state);
    for (int i = 0; i < context.state.cable_count; ++i) {
      const double shrink = 1.0 / (1.0 + compliance[0] * tension(context, i)) - 1.0;
      evaluation.length_m[i] += shrink * context.state.cable[i].length_m;
      evaluation.length_by_twist.row(i) += shrink * by_twist.row(i);
    }
  }
  void columns(const EffectContext& context, const EffectValues& compliance,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    for (int i = 0; i < rows.cables; ++i) {
      const double stretch = 1.0 + compliance[0] * tension(context, i);
      out(rows.length() + i, 0) =
          -context.state.cable[i].length_m * tension(context, i) / (stretch * stretch);
    }
  }

 private:
  /// Without a load cell there is nothing to stretch by.
  static double tension(const EffectContext& context, int cable) {
    const double value = context.measurement.tension_N[cable];
    return std::isfinite(value) ? value : 0.0;
  }
};

}  // namespace

std::shared_ptr<const Effect> cable_elasticity() { return std::make_shared<CableElasticity>(); }

}  // namespace cdprcal
