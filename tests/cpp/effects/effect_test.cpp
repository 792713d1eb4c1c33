// Every effect of the catalogue: derivatives by value and by pose, zero means absent, names.
#include <gtest/gtest.h>

#include <set>

#include "../support/numeric_jacobian.hpp"
#include "../support/random_measurement.hpp"
#include "../support/written_effects.hpp"
#include "cdprcal/effects/catalogue.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal {
std::shared_ptr<const Effect> swivel_drift();  // of docs/extend/effect.md
}

namespace cdprcal::test {
namespace {

/// Predicted readings and wrench, stacked as ReadingRows says. Angles relative to `about`.
Eigen::VectorXd predicted(const Robot& robot, const Measurement& m, const Pose& pose,
                          const ActiveEffects& effects, const PoseEvaluation* about,
                          PoseEvaluation& e) {
  evaluate_pose(with_effects(robot, effects), m, pose, StaticsModel::wrench, {}, effects, true, e);
  EXPECT_TRUE(e.valid);
  const ReadingRows rows{robot.cable_count()};
  Eigen::VectorXd out(rows.size());
  for (int i = 0; i < rows.cables; ++i) {
    out[i] = e.length_m[i];
    out[rows.swivel() + i] = about ? wrap_angle(e.swivel_rad[i] - about->swivel_rad[i]) : 0.0;
  }
  for (int a = 0; a < 3; ++a) {
    out[rows.attitude() + a] =
        about ? wrap_angle(e.roll_pitch_yaw_rad[a] - about->roll_pitch_yaw_rad[a]) : 0.0;
  }
  out.segment<6>(rows.wrench()) = e.wrench;
  out.segment<3>(rows.specific_force()) = e.specific_force_m_s2;
  return out;
}

EffectValues random_values(Rng& rng, const Effect& effect, const Robot& robot) {
  EffectValues values = effect.typical(robot);
  for (double& v : values) v *= uniform(rng, -1.0, 1.0);
  if (effect.info().one_sided) values = values.cwiseAbs();
  return values;
}

class EveryEffect : public ::testing::TestWithParam<std::shared_ptr<const Effect>> {};

TEST_P(EveryEffect, DerivativesByValueAndByPose) {
  const auto& effect = GetParam();
  Rng rng(5);
  for (const RobotPose& at : derivative_cases()) {
    SCOPED_TRACE(at.label);
    const bool of_radii =
        effect->name().ends_with("pulley_radius") || effect->name().ends_with("pulley_diameter");
    if (of_radii && at.robot.cables[0].pulley.radius_m == 0.0) continue;  // none is below
    const Vector3 angles =
        euler_from_rotation(at.pose.rotation_matrix(), at.robot.euler_convention);
    const Matrix3 rates = euler_rate_matrix(angles, at.robot.euler_convention);
    if (std::abs(rates.determinant()) < 0.3) continue;  // too near gimbal lock for differences
    const int n = at.robot.cable_count();
    const Measurement m = random_measurement(rng, at);
    EffectValues values = random_values(rng, *effect, at.robot);
    if (of_radii) values = values.cwiseAbs();  // the smallest of them stays above 0
    const ActiveEffects active{{effect, values}};
    PoseEvaluation about, scratch;
    predicted(at.robot, m, at.pose, active, nullptr, about);

    const Robot changed = with_effects(at.robot, active);
    const PlatformState state = platform_state(changed, at.pose);
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(ReadingRows{n}.size(), effect->size(n));
    effect->columns({changed, state, at.pose, m}, values, columns);
    const EffectValues scale = effect->typical(at.robot);
    NumericJacobian by_value = numeric_jacobian(
        [&](const Eigen::VectorXd& x) {
          return predicted(at.robot, m, at.pose, {{effect, EffectValues(x.cwiseProduct(scale))}},
                           &about, scratch);
        },
        values.cwiseQuotient(scale), 2e-2);
    // Angles count from `about`; their rounding errors are those of the angles themselves.
    by_value.magnitude = by_value.magnitude.cwiseMax(1e-6);
    EXPECT_TRUE(jacobian_matches(columns * scale.asDiagonal(), by_value, 1e-6)) << "by value";

    const NumericJacobian by_pose = numeric_pose_jacobian(
        [&](const Pose& pose) { return predicted(at.robot, m, pose, active, &about, scratch); },
        at.pose, 1e-3);
    Eigen::MatrixXd analytic(ReadingRows{n}.size(), 6);
    analytic << about.length_by_twist, about.swivel_by_twist, about.attitude_by_twist,
        about.wrench_by_twist, about.absolute_by_twist.specific_force_m_s2;
    EXPECT_TRUE(jacobian_matches(analytic, by_pose, 1e-6)) << "by pose";
  }
}

TEST_P(EveryEffect, ZeroIsAbsentAndValuesCount) {
  const auto& effect = GetParam();
  Rng rng(9);
  const RobotPose at = derivative_cases(4)[40];
  const int n = at.robot.cable_count();
  const Measurement m = random_measurement(rng, at);
  PoseEvaluation e;
  const Eigen::VectorXd without = predicted(at.robot, m, at.pose, {}, nullptr, e);
  PoseEvaluation about = e;
  const Eigen::VectorXd zero =
      predicted(at.robot, m, at.pose, {{effect, EffectValues::Zero(effect->size(n))}}, &about, e);
  const Eigen::VectorXd plain = predicted(at.robot, m, at.pose, {}, &about, e);
  EXPECT_LT((zero - plain).norm(), 1e-12);
  const Eigen::VectorXd one =
      predicted(at.robot, m, at.pose, {{effect, effect->typical(at.robot)}}, &about, e);
  EXPECT_GT((one - plain).norm(), 1e-6);
  EXPECT_EQ(effect->typical(at.robot).size(), effect->size(n));
  EXPECT_TRUE((effect->plausible(at.robot).array() >= effect->typical(at.robot).array()).all());
  const EffectValues values = effect->typical(at.robot);
  EXPECT_LT((effect->from_reported(effect->to_reported(values)) - values).norm(), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Catalogue, EveryEffect, ::testing::ValuesIn(effect_catalogue()),
                         [](const auto& info) { return info.param->name(); });

INSTANTIATE_TEST_SUITE_P(Written, EveryEffect, ::testing::ValuesIn(written_catalogue()),
                         [](const auto& info) { return info.param->name(); });

INSTANTIATE_TEST_SUITE_P(Documentation, EveryEffect, ::testing::Values(swivel_drift()),
                         [](const auto& info) { return info.param->name(); });

TEST(Catalogue, NamesAreUniqueAndRivalsExist) {
  std::set<std::string> names;
  for (const auto& effect : effect_catalogue()) {
    EXPECT_TRUE(names.insert(effect->name()).second) << effect->name();
    EXPECT_EQ(find_effect(effect->name()), effect);
  }
  for (const auto& effect : effect_catalogue()) {
    for (const char* rival : effect->info().confused_with) {
      EXPECT_TRUE(names.count(rival)) << effect->name() << " names rival " << rival;
    }
  }
  EXPECT_THROW(find_effect("gremlins"), InputError);
}

}  // namespace
}  // namespace cdprcal::test
