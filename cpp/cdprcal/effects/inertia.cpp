// The platform's moments of inertia are not those of the robot file.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class Inertia final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "inertia",
        .equation = "S I S, S = diag(exp(e / 2))",
        .parameters = {{.name = "error",
                        .unit = "1",
                        .shape = ParameterShape::vector3,
                        .typical = 0.15,
                        .plausible = 2.0}},
        .scope = EffectScope::robot,
        .confused_with = {},
        .sentence = "the platform's moments of inertia are not those of the robot file",
        .remedy = "correct the inertia in the robot file, or secure what moves on the platform",
        .settle = "let the platform swing about one axis after another",
        .on_request = true};
    return info;
  }
  void apply(const EffectValues& error, Robot& robot) const override {
    const Vector3 scale = (0.5 * error.array()).exp();
    robot.platform.inertia_kg_m2 =
        scale.asDiagonal() * robot.platform.inertia_kg_m2 * scale.asDiagonal();
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const Measurement& m = context.measurement;
    if (!m.moves()) return;
    const ReadingRows rows{context.state.cable_count};
    const Matrix3& r = context.state.rotation;
    const Matrix3& inertia = context.robot.platform.inertia_kg_m2;
    const Vector3 rate = m.twist.tail<3>(), by_s2 = m.acceleration.tail<3>();
    for (Eigen::Index k = 0; k < 3; ++k) {
      Matrix3 by_error = Matrix3::Zero();
      by_error.row(k) += 0.5 * inertia.row(k);
      by_error.col(k) += 0.5 * inertia.col(k);
      const Matrix3 world = r * by_error * r.transpose();
      out.col(k).segment<3>(rows.wrench() + 3) = world * by_s2 + rate.cross(Vector3(world * rate));
    }
  }
  Shows shows() const override { return Shows::in_moving_balance; }
};

}  // namespace

std::shared_ptr<const Effect> inertia() { return std::make_shared<Inertia>(); }

}  // namespace cdprcal
