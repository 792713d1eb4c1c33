// The attitude sensor is not mounted parallel to the platform frame.
#include "cdprcal/effects/effect.hpp"
#include "cdprcal/effects/turned_attitude.hpp"

namespace cdprcal {
namespace {

class AhrsMisalignment final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{
        .name = "ahrs_misalignment",
        .equation = "R* = R exp(rho)",
        .parameters = {{.name = "rotation_rad",
                        .unit = "rad",
                        .shape = ParameterShape::vector3,
                        .typical = 0.02,
                        .plausible = 0.105}},
        .scope = EffectScope::robot,
        .confused_with = {"centre_of_mass"},
        .sentence = "the attitude sensor is mounted askew on the platform",
        .remedy = "shim the sensor, or enter the mounting rotation",
        .settle = "level the platform with a spirit level and read roll and pitch"};
    return info;
  }
  void add_to_readings(const EffectContext& context, const EffectValues& rotation_rad,
                       PoseEvaluation& evaluation) const override {
    turn_attitude(context, Matrix3::Identity(), exp_so3(rotation_rad).toRotationMatrix(),
                  evaluation);
  }
  void columns(const EffectContext& context, const EffectValues& rotation_rad,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    const EulerConvention convention = context.robot.euler_convention;
    const Matrix3 mounting = exp_so3(rotation_rad).toRotationMatrix();
    const Matrix3 mounted = context.state.rotation * mounting;
    const Vector3 angles = euler_from_rotation(mounted, convention);
    out.middleRows<3>(rows.attitude()) = euler_rate_matrix(angles, convention).inverse() *
                                         context.state.rotation * left_jacobian_so3(rotation_rad);
  }
};

}  // namespace

std::shared_ptr<const Effect> ahrs_misalignment() { return std::make_shared<AhrsMisalignment>(); }

}  // namespace cdprcal
