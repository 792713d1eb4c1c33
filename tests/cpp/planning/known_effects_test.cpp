// Effects that the robot file lists: what the load cells read, and where the platform rests.
#include "cdprcal/planning/known_effects.hpp"

#include <gtest/gtest.h>

#include "../support/table2.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal {
namespace {

Robot irma4_with(std::vector<AppliedEffect> effects) {
  Robot robot = load_robot("irma4");
  robot.effects = std::move(effects);
  finalise(robot);
  return robot;
}

const AppliedEffect kBias{"load_cell_bias", "", {{"bias_N", {5.0, -3.0, 0.0, 8.0}}}};
const AppliedEffect kGain{"load_cell_gain", "", {{"gain_error", {0.05, -0.02, 0.0, 0.01}}}};
const AppliedEffect kForce{"external_force", "", {{"force_N", {2.0, -1.0, -1.5}}}};
const AppliedEffect kSag{"cable_sag", "", {{"linear_density_kg_m", {0.05}}}};
const AppliedEffect kMass{"mass", "", {{"mass_error_kg", {0.5}}}};
const AppliedEffect kFriction{"pulley_friction", "", {{"coefficient", {0.03}}}};

TEST(KnownEffects, OfNoneChangeNothing) {
  const KnownEffects none(load_robot("irma4"));
  EXPECT_FALSE(none.any());
  const Pose pose = test::kTable2[0].pose();
  const CableVector tension = test::kTable2[0].tension();
  EXPECT_EQ(none.reading_N(pose, tension), tension);
  EXPECT_EQ(none.tension_N(pose, tension), tension);
}

TEST(KnownEffects, OfGeometryAndInertiaAreAppliedOnce) {
  const KnownEffects known(irma4_with({kMass}));
  EXPECT_NEAR(known.robot().platform.mass_kg, 13.492, 1e-12);
  EXPECT_TRUE(known.robot().effects.empty());
  EXPECT_NEAR(KnownEffects(known.robot()).robot().platform.mass_kg, 13.492, 1e-12);
}

TEST(KnownEffects, ReadingsAndTensionsGoBothWays) {
  const KnownEffects known(irma4_with({kBias, kGain, kSag, kFriction}));
  for (const test::Table2Row& row : test::kTable2) {
    const CableVector reading = known.reading_N(row.pose(), row.tension());
    EXPECT_LT((known.tension_N(row.pose(), reading) - row.tension()).norm(), 1e-9);
    EXPECT_GT((reading - row.tension()).norm(), 3.0);
  }
}

TEST(KnownEffects, ThePlatformRestsWhereAllOfThemBalance) {
  const Robot robot = irma4_with({kBias, kGain, kForce, kSag});
  const KnownEffects known(robot);
  for (const test::Table2Row& row : test::kTable2) {
    const CableVector reading = known.reading_N(row.pose(), row.tension());
    const std::optional<Pose> rest = known.settled(reading, row.pose());
    ASSERT_TRUE(rest);
    // Written out by hand: cables, weight, the force at the centre of mass, half of each cable's
    // weight on its anchor, and the chord that pulls less than the load cell at the pulley.
    const PlatformState state = platform_state(robot, *rest);
    const double g = robot.gravity_m_s2, density = 0.05;
    Vector6 left = -gravity_wrench(robot, state);
    const Vector3 force(2.0, -1.0, -1.5);
    left.head<3>() -= force;
    left.tail<3>() -= state.centre_of_mass_arm_m.cross(force);
    for (int i = 0; i < 4; ++i) {
      const CableState& cable = state.cable[i];
      const double gain = kGain.parameters[0].values[i], bias = kBias.parameters[0].values[i];
      const double weight = density * g * cable.free_length_m;
      const double tension =
          reading[i] - bias - reading[i] * gain / (1.0 + gain) + 0.5 * cable.direction.z() * weight;
      const Vector3 pull = tension * cable.direction + Vector3(0.0, 0.0, 0.5 * weight);
      left.head<3>() += pull;
      left.tail<3>() += state.anchor_arm_m[i].cross(pull);
    }
    EXPECT_LT(left.norm(), 1e-6);
    EXPECT_GT(minus(*rest, row.pose()).norm(), 1e-3);
    // The way back to what was planned.
    const std::optional<SetPoint> planned = known.as_planned({row.pose(), reading});
    ASSERT_TRUE(planned);
    EXPECT_LT((planned->tension_N - row.tension()).norm(), 1e-9);
    EXPECT_LT(minus(planned->pose, row.pose()).norm(), 2e-5);  // rows 1 to 4: see direct_test
  }
}

TEST(KnownEffects, AForceThatPullsThePlatformAwayHasNoRest) {
  AppliedEffect strong = kForce;
  strong.parameters[0].values = {400.0, 0.0, 0.0};
  Robot robot = load_robot("irma4");
  robot.effects = {strong};  // not finalised: that would refuse so strong a force
  const KnownEffects known(robot);
  const Pose pose = test::kTable2[0].pose();
  EXPECT_FALSE(known.settled(test::kTable2[0].tension(), pose));
  const PlanResult plan = make_plan(robot);
  EXPECT_EQ(plan.status, PlanStatus::infeasible);
  EXPECT_NE(plan.reason.find("effects that the robot file lists"), std::string::npos);
  EXPECT_TRUE(plan.plan.poses.empty());
}

TEST(KnownEffects, APlanWithAllOfThemIsVerified) {
  const Robot robot = irma4_with({kBias, kGain, kForce, kSag, kMass});
  const PlanResult result = make_plan(robot);
  ASSERT_EQ(result.status, PlanStatus::planned) << result.reason;
  EXPECT_EQ(verify_plan(robot, result.plan), "");
  EXPECT_NE(verify_plan(load_robot("irma4"), result.plan), "");
}

}  // namespace
}  // namespace cdprcal
