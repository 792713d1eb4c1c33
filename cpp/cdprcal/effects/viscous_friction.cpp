// Pulleys and guides hold a cable back the more, the faster it runs.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class ViscousFriction final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "viscous_friction",
        .equation = "tau* = tau - c dl/dt",
        .parameters = {{.name = "coefficient_Ns_m",
                        .unit = "Ns/m",
                        .shape = ParameterShape::scalar,
                        .typical = 5.0,
                        .plausible = 60.0,
                        .of = Yardstick::weight,
                        .range = ValueRange::not_negative}},
        .scope = EffectScope::robot,
        .confused_with = {"pulley_friction", "bending_hysteresis"},
        .sentence =
            "friction that grows with speed: the load cells read less, the faster the "
            "cable pays out",
        .remedy = "replace stiff grease or worn guides, or enter the coefficient",
        .settle = "drive the same way at two speeds",
        .one_sided = true};
    return info;
  }
  void correct_tension(const EffectContext& context, const EffectValues& coefficient_Ns_m,
                       CableVector& tension_N) const override {
    const CableVector& rate_m_s = context.measurement.length_rate_m_s;
    if (rate_m_s.size() > 0) tension_N += coefficient_Ns_m[0] * rate_m_s;
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const CableVector& rate_m_s = context.measurement.length_rate_m_s;
    if (rate_m_s.size() == 0) return;
    const CableVector read = context.measurement.tension_N;
    out.middleRows<6>(ReadingRows{context.state.cable_count}.wrench()) = wrench_by_tension(
        context.state, read.array().isNaN().select(Eigen::VectorXd::Constant(read.size(), kNaN),
                                                   Eigen::VectorXd(rate_m_s)));
  }
  Shows shows() const override { return Shows::in_moving_balance; }
};

}  // namespace

std::shared_ptr<const Effect> viscous_friction() { return std::make_shared<ViscousFriction>(); }

}  // namespace cdprcal
