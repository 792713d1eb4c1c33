#include "cdprcal/motion/known_motion.hpp"

#include <algorithm>

#include "cdprcal/motion/inertial_wrench.hpp"

namespace cdprcal {
namespace {

class MovingPlatform final : public Effect {
 public:
  MovingPlatform(std::vector<KnownMotion> moments, const MotionDamping& damping)
      : moments_(std::move(moments)), damping_(damping.shift_1_s, damping.turn_1_s) {
    std::sort(moments_.begin(), moments_.end(), by_time);
  }

  const EffectInfo& info() const override {
    static const EffectInfo info{.name = "known_motion",
                                 .equation = "f - M dv/dt - h(v)",
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
    const auto at = std::lower_bound(moments_.begin(), moments_.end(),
                                     KnownMotion{context.measurement.time_s, {}, {}}, by_time);
    if (at == moments_.end() || at->time_s != context.measurement.time_s) return;
    const InertialWrench inertial =
        inertial_wrench(context.robot, context.state, at->twist, at->acceleration);
    evaluation.wrench +=
        inertial.wrench + damping_wrench(context.robot, context.state, at->twist) * damping_;
    evaluation.wrench_by_twist.rightCols<3>() +=
        inertial.by_rotation + damping_by_rotation(context, at->twist);
  }
  void columns(const EffectContext&, const EffectValues&, EffectColumns) const override {}

 private:
  static bool by_time(const KnownMotion& a, const KnownMotion& b) { return a.time_s < b.time_s; }
  /// Of the damping's wrench, by a world-frame turn.
  [[nodiscard]] Eigen::Matrix<double, 6, 3> damping_by_rotation(const EffectContext& context,
                                                                const Vector6& twist) const {
    const Platform& platform = context.robot.platform;
    const Vector3& arm = context.state.centre_of_mass_arm_m;
    const Vector3 turning = twist.tail<3>();
    const double of_shift = 2.0 * platform.mass_kg * damping_[0];
    const Vector3 force = of_shift * (twist.head<3>() + turning.cross(arm));
    const Matrix3& r = context.state.rotation;
    const Matrix3 inertia = 2.0 * damping_[1] * r * platform.inertia_kg_m2 * r.transpose();
    Eigen::Matrix<double, 6, 3> out;
    out.topRows<3>() = -of_shift * skew(turning) * skew(arm);
    out.bottomRows<3>() = skew(force) * skew(arm) + skew(arm) * out.topRows<3>() +
                          inertia * skew(turning) - skew(inertia * turning);
    return out;
  }

  std::vector<KnownMotion> moments_;
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

std::shared_ptr<const Effect> known_motion(std::vector<KnownMotion> moments,
                                           const MotionDamping& damping) {
  return std::make_shared<MovingPlatform>(std::move(moments), damping);
}

}  // namespace cdprcal
