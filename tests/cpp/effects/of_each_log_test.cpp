// What differs from log to log is the same effect with values of each log's own.
#include "cdprcal/effects/of_each_log.hpp"

#include <gtest/gtest.h>

#include <string>

#include "cdprcal/effects/catalogue.hpp"
#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal {
namespace {

TEST(OfEachLog, IsTheSameEffectOfARun) {
  const Robot robot = load_robot("irma4");
  Pose pose;
  pose.position_m = Vector3(0.1, -0.2, 0.9);
  const PlatformState state = platform_state(robot, pose);
  ASSERT_TRUE(state.valid);
  Measurement m;
  m.length_m = CableVector::Constant(4, 1.5);
  m.swivel_rad = CableVector::Constant(4, 0.2);
  m.tension_N = CableVector::Constant(4, 60.0);
  m.roll_pitch_yaw_rad = Vector3(0.02, -0.03, 0.1);
  m.length_direction = m.swivel_direction = CableVector::Constant(4, 1.0);
  m.run_time_s = 12.0;
  int of_the_robot = 0;
  for (const auto& effect : effect_catalogue()) {
    SCOPED_TRACE(effect->name());
    const auto own = of_each_log(effect);
    if (effect->info().scope == EffectScope::run) {
      EXPECT_EQ(own, nullptr);
      continue;
    }
    ++of_the_robot;
    ASSERT_NE(own, nullptr);
    EXPECT_EQ(own, of_each_log(effect));
    EXPECT_EQ(of_each_log(own), nullptr);
    EXPECT_EQ(of_all_logs(own), effect);
    EXPECT_EQ(of_all_logs(effect), effect);
    EXPECT_TRUE(is_of_each_log(*own));
    EXPECT_FALSE(is_of_each_log(*effect));
    EXPECT_EQ(own->info().scope, EffectScope::run);
    EXPECT_EQ(own->name(), effect->name());
    EXPECT_EQ(own->moves_cables(), effect->moves_cables());
    EXPECT_EQ(own->shows(), effect->shows());
    EXPECT_EQ(own->learnt_widths(4), effect->learnt_widths(4));
    const EffectValues values = 0.5 * effect->typical(robot);
    ASSERT_EQ(own->typical(robot), effect->typical(robot));
    const EffectContext context{robot, state, pose, m};
    const auto columns = [&](const Effect& of) {
      Eigen::MatrixXd out = Eigen::MatrixXd::Zero(ReadingRows{4}.size(), values.size());
      of.columns(context, values, out);
      return out;
    };
    EXPECT_EQ(columns(*own), columns(*effect));
    const auto tension = [&](const Effect& of) {
      CableVector out = m.tension_N;
      of.correct_tension(context, values, out);
      return out;
    };
    EXPECT_EQ(tension(*own), tension(*effect));
    const auto lengths = [&](const std::shared_ptr<const Effect>& of) {
      PoseEvaluation e;
      evaluate_pose(with_effects(robot, {{of, values}}), m, pose, StaticsModel::wrench, {},
                    {{of, values}}, true, e);
      return e.length_m;
    };
    EXPECT_EQ(lengths(own), lengths(effect));
  }
  EXPECT_GT(of_the_robot, 15);
}

}  // namespace
}  // namespace cdprcal
