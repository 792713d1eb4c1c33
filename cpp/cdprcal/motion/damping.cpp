#include "cdprcal/motion/damping.hpp"

namespace cdprcal {
namespace {

class KnownDamping final : public Effect {
 public:
  explicit KnownDamping(const MotionDamping& damping)
      : damping_(damping.shift_1_s, damping.turn_1_s) {}

  const EffectInfo& info() const override {
    static const EffectInfo info{.name = "known_damping",
                                 .equation = "f - 2 m v / T - 2 I omega / T",
                                 .parameters = {},
                                 .scope = EffectScope::run,
                                 .confused_with = {},
                                 .sentence = "the platform moved while it was measured",
                                 .remedy = "",
                                 .settle = ""};
    return info;
  }
  void add_to_readings(const EffectContext& context, const EffectValues&,
                       PoseEvaluation& evaluation) const override {
    const Vector6& twist = context.measurement.twist;
    if (twist.isZero()) return;
    const Vector6 wrench = damping_wrench(context.robot, context.state, twist) * damping_;
    evaluation.wrench += wrench;
    // By a world-frame turn.
    const Platform& platform = context.robot.platform;
    const Vector3& arm = context.state.centre_of_mass_arm_m;
    const Vector3 turning = twist.tail<3>();
    const Matrix3 force_by_turn = -2.0 * platform.mass_kg * damping_[0] * skew(turning) * skew(arm);
    const Matrix3& r = context.state.rotation;
    const Matrix3 inertia = 2.0 * damping_[1] * r * platform.inertia_kg_m2 * r.transpose();
    auto by_turn = evaluation.wrench_by_twist.rightCols<3>();
    by_turn.topRows<3>() += force_by_turn;
    by_turn.bottomRows<3>() += skew(wrench.head<3>()) * skew(arm) + skew(arm) * force_by_turn +
                               inertia * skew(turning) - skew(inertia * turning);
  }
  void columns(const EffectContext&, const EffectValues&, EffectColumns) const override {}
  Shows shows() const override { return Shows::in_moving_balance; }

 private:
  Eigen::Vector2d damping_;
};

}  // namespace

Eigen::Matrix<double, 6, 2> damping_wrench(const Robot& robot, const PlatformState& state,
                                           const Vector6& twist) {
  const Vector3& arm = state.centre_of_mass_arm_m;
  const Vector3 turning = twist.tail<3>();
  const Vector3 force = 2.0 * robot.platform.mass_kg * (twist.head<3>() + turning.cross(arm));
  const Matrix3& r = state.rotation;
  Eigen::Matrix<double, 6, 2> out;
  out << force, Vector3::Zero(), arm.cross(force),
      2.0 * r * robot.platform.inertia_kg_m2 * r.transpose() * turning;
  return out;
}

std::shared_ptr<const Effect> known_damping(const MotionDamping& damping) {
  return std::make_shared<KnownDamping>(damping);
}

}  // namespace cdprcal
