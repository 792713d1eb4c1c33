// The AHRS counts a little more or less than the platform leans.
#include "cdprcal/effects/effect.hpp"

namespace cdprcal {
namespace {

class AttitudeScale final : public Effect {
 public:
  const EffectInfo& info() const override {
    static const EffectInfo info{.name = "attitude_scale",
                                 .equation = "roll* = (1 + g_1) roll, pitch* = (1 + g_2) pitch",
                                 .parameters = {{.name = "roll_error",
                                                 .unit = "1",
                                                 .shape = ParameterShape::scalar,
                                                 .typical = 0.03,
                                                 .plausible = 0.3,
                                                 .range = ValueRange::above_minus_one},
                                                {.name = "pitch_error",
                                                 .unit = "1",
                                                 .shape = ParameterShape::scalar,
                                                 .typical = 0.03,
                                                 .plausible = 0.3,
                                                 .range = ValueRange::above_minus_one}},
                                 .scope = EffectScope::robot,
                                 .confused_with = {"ahrs_misalignment", "centre_of_mass"},
                                 .sentence = "roll or pitch of the AHRS has a wrong scale",
                                 .remedy = "calibrate the AHRS, or enter its scale",
                                 .settle = "lean the platform by a known angle"};
    return info;
  }
  void add_to_readings(const EffectContext& context, const EffectValues& scale_error,
                       PoseEvaluation& evaluation) const override {
    const EulerConvention convention = context.robot.euler_convention;
    const Vector3 angles = euler_from_rotation(context.state.rotation, convention);
    const Matrix3 by_turn = euler_rate_matrix(angles, convention).inverse();
    for (int k = 0; k < 2; ++k) {
      evaluation.roll_pitch_yaw_rad[k] += scale_error[k] * angles[k];
      evaluation.attitude_by_twist.row(k).tail<3>() += scale_error[k] * by_turn.row(k);
    }
  }
  void columns(const EffectContext& context, const EffectValues&,
               EffectColumns out) const override {
    const ReadingRows rows{context.state.cable_count};
    const Vector3 angles =
        euler_from_rotation(context.state.rotation, context.robot.euler_convention);
    for (int k = 0; k < 2; ++k) out(rows.attitude() + k, k) = angles[k];
  }
};

}  // namespace

std::shared_ptr<const Effect> attitude_scale() { return std::make_shared<AttitudeScale>(); }

}  // namespace cdprcal
