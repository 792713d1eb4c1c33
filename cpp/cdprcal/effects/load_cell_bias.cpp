// Load cells do not read zero without load.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class LoadCellBias final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "load_cell_bias",
        .equation = "tau* = tau + b_i",
        .parameters = {{.name = "bias_N",
                        .unit = "N",
                        .shape = ParameterShape::per_cable,
                        .typical = 8.0,
                        .plausible = 60.0,
                        .of = Yardstick::weight}},
        .scope = EffectScope::robot,
        .confused_with = {"mass", "external_force", "load_cell_drift"},
        .sentence = "a load cell reads a constant amount too much or too little",
        .remedy = "tare the named load cells",
        .settle = "unload the cables and read the cells; weigh the platform for the common part",
        .of_load_cells = true};
    return info;
  }
  void correct_tension(const EffectContext&, const EffectValues& bias_N,
                       CableVector& tension_N) const override {
    tension_N -= bias_N;
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    out.middleRows<6>(rows.wrench()) = -structure_matrix(context.state);
  }
};

}  // namespace

std::shared_ptr<const Effect> load_cell_bias() { return std::make_shared<LoadCellBias>(); }

}  // namespace cdprcal
