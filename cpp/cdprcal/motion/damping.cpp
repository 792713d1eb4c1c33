#include "cdprcal/motion/damping.hpp"

namespace cdprcal {
namespace {

class Damping final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{.name = "damping",
                                 .equation = "f - 2 m v / T - 2 I omega / T",
                                 .parameters = {{.name = "shift_1_s",
                                                 .unit = "1/s",
                                                 .shape = ParameterShape::scalar,
                                                 .typical = 1.0,
                                                 .plausible = 20.0},
                                                {.name = "turn_1_s",
                                                 .unit = "1/s",
                                                 .shape = ParameterShape::scalar,
                                                 .typical = 1.0,
                                                 .plausible = 20.0}},
                                 .scope = EffectScope::run,
                                 .confused_with = {},
                                 .sentence = "the platform is held back while it moves",
                                 .remedy = "",
                                 .settle = ""};
    return info;
  }
  void add_to_readings(const EffectContext& context, const EffectValues& by_s,
                       PoseEvaluation& evaluation) const override {
    const Vector6& twist = context.measurement.twist;
    if (twist.isZero()) return;
    const Vector6 wrench = unit_wrenches(context) * by_s;
    evaluation.wrench += wrench;
    // By a world-frame turn.
    const Platform& platform = context.robot.platform;
    const Matrix3 arm = skew(context.state.centre_of_mass_arm_m);
    const Vector3 turning = twist.tail<3>();
    const Matrix3& r = context.state.rotation;
    const Matrix3 inertia = 2.0 * by_s[1] * r * platform.inertia_kg_m2 * r.transpose();
    const Matrix3 force_by_turn = -2.0 * platform.mass_kg * by_s[0] * skew(turning) * arm;
    auto by_turn = evaluation.wrench_by_twist.rightCols<3>();
    by_turn.topRows<3>() += force_by_turn;
    by_turn.bottomRows<3>() += skew(wrench.head<3>()) * arm + arm * force_by_turn +
                               inertia * skew(turning) - skew(inertia * turning);
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    out.middleRows<6>(rows.wrench()) = unit_wrenches(context);
  }
  Shows shows() const override { return Shows::in_moving_balance; }

 private:
  /// Of the balance's sign: one column a value.
  static Eigen::Matrix<double, 6, 2> unit_wrenches(const EffectContext& context) {
    const Platform& platform = context.robot.platform;
    const Vector3& arm = context.state.centre_of_mass_arm_m;
    const Vector6& twist = context.measurement.twist;
    const Vector3 turning = twist.tail<3>();
    const Vector3 force = 2.0 * platform.mass_kg * (twist.head<3>() + turning.cross(arm));
    const Matrix3& r = context.state.rotation;
    Eigen::Matrix<double, 6, 2> out;
    out << force, Vector3::Zero(), arm.cross(force),
        2.0 * r * platform.inertia_kg_m2 * r.transpose() * turning;
    return out;
  }
};

}  // namespace

std::shared_ptr<const Effect> damping() {
  static const auto effect = std::make_shared<Damping>();
  return effect;
}

}  // namespace cdprcal
