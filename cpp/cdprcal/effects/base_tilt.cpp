// The frame does not stand level: gravity pulls aside, and the AHRS tells it.
#include "cdprcal/effects/effect.hpp"
#include "cdprcal/effects/turned_attitude.hpp"

namespace cdprcal {
namespace {

class BaseTilt final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "base_tilt",
        .equation = "R* = exp(beta) R, g* = exp(-beta) g",
        .parameters = {{.name = "about_x_rad",
                        .unit = "rad",
                        .shape = ParameterShape::scalar,
                        .typical = 0.01,
                        .plausible = 0.1},
                       {.name = "about_y_rad",
                        .unit = "rad",
                        .shape = ParameterShape::scalar,
                        .typical = 0.01,
                        .plausible = 0.1}},
        .scope = EffectScope::robot,
        .confused_with = {"ahrs_misalignment", "external_force", "centre_of_mass"},
        .sentence = "the frame stands askew: its z axis is not the vertical",
        .remedy = "level the frame, or enter its tilt",
        .settle = "put a spirit level on the frame"};
    return info;
  }
  void add_to_readings(const EffectContext& context, const EffectValues& tilt_rad,
                       PoseEvaluation& evaluation) const override {
    const Matrix3 level = exp_so3(about(tilt_rad)).toRotationMatrix();  // from frame to level axes
    turn_attitude(context, level, Matrix3::Identity(), evaluation);
    const Vector3 weight = context.robot.gravity_force_N();
    const Vector3 aside = level.transpose() * weight - weight;
    const Vector3& arm = context.state.centre_of_mass_arm_m;
    evaluation.wrench.head<3>() -= aside;
    evaluation.wrench.tail<3>() -= arm.cross(aside);
    evaluation.wrench_by_twist.bottomRightCorner<3, 3>() -= skew(aside) * skew(arm);
    const Matrix3 to_platform = context.state.rotation.transpose();
    const Vector3 up = -aside / context.robot.platform.mass_kg;
    evaluation.specific_force_m_s2 += to_platform * up;
    evaluation.absolute_by_twist.specific_force_m_s2.rightCols<3>() += to_platform * skew(up);
  }
  void columns(const EffectContext& context, const EffectValues& tilt_rad,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    const EulerConvention convention = context.robot.euler_convention;
    const Vector3 beta = about(tilt_rad);
    const Matrix3 level = exp_so3(beta).toRotationMatrix();
    const Vector3 angles = euler_from_rotation(level * context.state.rotation, convention);
    out.middleRows<3>(rows.attitude()) =
        (euler_rate_matrix(angles, convention).inverse() * left_jacobian_so3(beta)).leftCols<2>();
    const Vector3 weight = level.transpose() * context.robot.gravity_force_N();
    const Eigen::Matrix<double, 3, 2> aside =
        (skew(weight) * left_jacobian_so3(-beta)).leftCols<2>();
    out.middleRows<3>(rows.wrench()) = -aside;
    out.middleRows<3>(rows.wrench() + 3) = -skew(context.state.centre_of_mass_arm_m) * aside;
    out.middleRows<3>(rows.specific_force()) =
        -context.state.rotation.transpose() * aside / context.robot.platform.mass_kg;
  }

 private:
  static Vector3 about(const EffectValues& tilt_rad) { return {tilt_rad[0], tilt_rad[1], 0.0}; }
};

}  // namespace

std::shared_ptr<const Effect> base_tilt() { return std::make_shared<BaseTilt>(); }

}  // namespace cdprcal
