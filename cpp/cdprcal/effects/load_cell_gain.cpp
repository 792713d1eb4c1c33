// Load cells scale the tension a little wrongly.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class LoadCellGain final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "load_cell_gain",
        .equation = "tau* = (1 + gamma_i) tau",
        .parameters = {{.name = "gain_error",
                        .unit = "1",
                        .shape = ParameterShape::per_cable,
                        .typical = 0.04,
                        .plausible = 0.3,
                        .range = ValueRange::above_minus_one}},
        .scope = EffectScope::robot,
        .confused_with = {"mass", "load_cell_bias", "cable_elasticity"},
        .sentence = "a load cell has a wrong scale",
        .remedy = "calibrate the named load cells with known weights",
        .settle = "weigh the platform: the common part of the gains is the mass",
        .of_load_cells = true};
    return info;
  }
  void correct_tension(const EffectContext& context, const EffectValues& gain_error,
                       CableVector& tension_N) const override {
    for (int i = 0; i < context.state.cable_count; ++i) {
      tension_N[i] -= context.measurement.tension_N[i] * gain_error[i] / (1.0 + gain_error[i]);
    }
  }
  void columns(const EffectContext& context, const EffectValues& gain_error,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    const WrenchMatrix structure = structure_matrix(context.state);
    for (int i = 0; i < rows.cables; ++i) {
      const double gain = 1.0 + gain_error[i];
      out.col(i).segment<6>(rows.wrench()) =
          -structure.col(i) * context.measurement.tension_N[i] / (gain * gain);
    }
  }
};

}  // namespace

std::shared_ptr<const Effect> load_cell_gain() { return std::make_shared<LoadCellGain>(); }

}  // namespace cdprcal
