// Load cells warm up: their zero moves with time.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class LoadCellDrift final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "load_cell_drift",
        .equation = "tau* = tau + rate t",
        .parameters = {{.name = "rate_N_s",
                        .unit = "N/s",
                        .shape = ParameterShape::scalar,
                        .typical = 0.02,
                        .plausible = 0.2,
                        .of = Yardstick::weight}},
        .scope = EffectScope::run,
        .confused_with = {"load_cell_bias"},
        .sentence = "the load cells drift with time",
        .remedy = "let the amplifiers warm up before the run, and tare again",
        .settle = "return to the first pose at the end of the run",
        .of_load_cells = true};
    return info;
  }
  void correct_tension(const EffectContext& context, const EffectValues& rate_N_s,
                       CableVector& tension_N) const override {
    tension_N.array() -= rate_N_s[0] * context.measurement.run_time_s;
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    // Into a vector of its own first: Eigen 3.4 asserts on partial sums into an unaligned target.
    const Vector6 wrench_by_tension = structure_matrix(context.state).rowwise().sum();
    out.middleRows<6>(rows.wrench()) = -context.measurement.run_time_s * wrench_by_tension;
  }
};

}  // namespace

std::shared_ptr<const Effect> load_cell_drift() { return std::make_shared<LoadCellDrift>(); }

}  // namespace cdprcal
