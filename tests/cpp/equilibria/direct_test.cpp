// Direct geometrico-static problem: from tensions and from lengths.
#include "cdprcal/equilibria/direct.hpp"

#include <gtest/gtest.h>

#include "../support/table2.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/error.hpp"
#include "robots.hpp"

namespace cdprcal {
namespace {

using namespace test;  // NOLINT: test vocabulary

CableVector tensions(std::initializer_list<double> values) {
  CableVector result(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), result.data());
  return result;
}

// Rows 5 to 8 are equilibria to within their six printed decimals. Rows 1 to 4 are off balance by
// 3e-4 N, which moves the true equilibrium by 1.1e-5 rad: first-order statics predicts that shift,
// so the pose found is checked to 1e-8 against "the row corrected for its own imbalance".
TEST(DirectFromTensions, FindsEveryRowOfTable2) {
  const Robot robot = irma4();
  for (std::size_t i = 0; i < kTable2.size(); ++i) {
    SCOPED_TRACE("row " + std::to_string(i + 1));
    const Pose pose = kTable2[i].pose();
    const CableVector tension = kTable2[i].tension();
    const EquilibriumResult found = direct_from_tensions(robot, tension);
    ASSERT_EQ(found.status, EquilibriumStatus::found) << found.reason;
    EXPECT_TRUE(found.stable);
    EXPECT_LT(imbalance(robot, found.pose, tension), 1e-10 * robot.weight_N());
    const PlatformState state = platform_state(robot, pose);
    const Vector6 shift =
        -solve_square(stiffness(robot, state, tension), wrench_residual(robot, state, tension));
    EXPECT_LT((minus(found.pose, pose) - shift).norm(), 1e-8);
    EXPECT_LT(distance(found.pose, pose), i < 4 ? 1.2e-5 : 1e-6);
  }
}

TEST(DirectFromTensions, StandsMeasuredTensionsFivePercentOff) {
  const Robot robot = irma4();
  Rng rng(1);
  std::normal_distribution<double> noise(0.0, 0.05);
  for (int trial = 0; trial < 400; ++trial) {
    CableVector tension = kTable2[trial % 8].tension();
    for (double& t : tension) t *= 1.0 + noise(rng);
    const EquilibriumResult found = direct_from_tensions(robot, tension);
    ASSERT_EQ(found.status, EquilibriumStatus::found) << found.reason;
    EXPECT_LT(imbalance(robot, found.pose, tension), 1e-9 * robot.weight_N());
    EXPECT_LT(distance(found.pose, kTable2[trial % 8].pose()), 0.5);
  }
}

TEST(DirectFromTensions, AWarmStartGivesTheSamePose) {
  const Robot robot = irma4();
  Rng rng(2);
  for (const Table2Row& row : kTable2) {
    const EquilibriumResult cold = direct_from_tensions(robot, row.tension());
    Vector6 off = Vector6::Random() * 0.1;
    const EquilibriumResult warm = direct_from_tensions(robot, row.tension(), plus(cold.pose, off));
    ASSERT_EQ(warm.status, EquilibriumStatus::found);
    EXPECT_LT(distance(warm.pose, cold.pose), 1e-9);
    EXPECT_LT(warm.evaluations, 15);
  }
}

TEST(DirectFromTensions, AHopelessStartFallsBackToTheOthers) {
  const Robot robot = irma4();
  const CableVector tension = kTable2[0].tension();
  const Pose upside_down{{0.0, 0.0, 1.2}, Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0)};
  const EquilibriumResult found = direct_from_tensions(robot, tension, upside_down);
  ASSERT_EQ(found.status, EquilibriumStatus::found);
  EXPECT_LT(distance(found.pose, direct_from_tensions(robot, tension).pose), 1e-9);
}

TEST(DirectFromTensions, IsAMinimumOfThePotential) {
  Rng rng(3);
  int checked = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const Robot robot = random_robot(rng, 3 + trial % 4, trial % 2 == 0);
    const CableVector tension = carrying_tensions(rng, robot);
    const EquilibriumResult found = direct_from_tensions(robot, tension);
    if (found.status != EquilibriumStatus::found) continue;
    ++checked;
    const auto potential = [&](const Pose& pose) {
      return potential_energy(robot, pose, platform_state(robot, pose), tension);
    };
    const double lowest = potential(found.pose);
    for (int k = 0; k < 30; ++k) {
      const Vector6 twist = 1e-3 * Vector6::NullaryExpr([&] { return uniform(rng, -1.0, 1.0); });
      EXPECT_GT(potential(plus(found.pose, twist)), lowest);
    }
  }
  EXPECT_GT(checked, 40);
}

TEST(DirectFromTensions, MirroredTensionsHangAtTheMirroredPose) {
  const Robot robot = symmetric_irma4();
  Rng rng(4);
  for (int trial = 0; trial < 20; ++trial) {
    const CableVector tension = carrying_tensions(rng, robot);
    const EquilibriumResult found = direct_from_tensions(robot, tension);
    ASSERT_EQ(found.status, EquilibriumStatus::found) << found.reason;
    for (const int axis : {0, 1}) {
      const EquilibriumResult other = direct_from_tensions(robot, mirrored(tension, axis));
      ASSERT_EQ(other.status, EquilibriumStatus::found);
      EXPECT_LT(distance(other.pose, mirrored(found.pose, axis)), 1e-9);
    }
  }
}

TEST(DirectFromTensions, ATurnedRobotHangsTurned) {
  Rng rng(5);
  for (int trial = 0; trial < 20; ++trial) {
    const Robot robot = trial == 0 ? irma4() : random_robot(rng, 4);
    const CableVector tension = carrying_tensions(rng, robot);
    const double angle = uniform(rng, -kPi, kPi);
    const EquilibriumResult found = direct_from_tensions(robot, tension);
    const EquilibriumResult other = direct_from_tensions(turned(robot, angle), tension);
    ASSERT_EQ(found.status, other.status);
    if (found.status != EquilibriumStatus::found) continue;
    EXPECT_LT(distance(other.pose, turned(found.pose, angle)), 1e-8);
    EXPECT_NEAR(other.stability.constant_tensions_N_m, found.stability.constant_tensions_N_m,
                1e-6 * found.stability.constant_tensions_N_m);
  }
}

TEST(DirectFromTensions, ScalingMassAndTensionsMovesNothing) {
  Robot robot = irma4();
  const CableVector tension = kTable2[4].tension();
  const Pose pose = direct_from_tensions(robot, tension).pose;
  robot.platform.mass_kg *= 3.7;
  const EquilibriumResult heavy = direct_from_tensions(robot, CableVector(3.7 * tension));
  ASSERT_EQ(heavy.status, EquilibriumStatus::found);
  EXPECT_LT(distance(heavy.pose, pose), 1e-10);
}

// Failure is a status with a reason and no pose.
void expect_no_pose(const EquilibriumResult& result) {
  EXPECT_FALSE(result.balanced());
  EXPECT_FALSE(result.stable);
  EXPECT_FALSE(result.reason.empty());
  EXPECT_TRUE(result.pose.position_m.array().isNaN().all());
  EXPECT_TRUE(result.pose.rotation.coeffs().array().isNaN().all());
  EXPECT_TRUE(std::isnan(result.residual_N));
}

TEST(DirectFromTensions, TooLittleTensionIsNotFound) {
  const Robot robot = irma4();
  const EquilibriumResult weak = direct_from_tensions(robot, tensions({30, 30, 30, 30}));
  expect_no_pose(weak);
  EXPECT_NE(weak.reason.find("less than the weight"), std::string::npos) << weak.reason;
}

TEST(DirectFromTensions, ATensionThatOutweighsEverythingIsNotFound) {
  const Robot robot = irma4();
  const EquilibriumResult result = direct_from_tensions(robot, tensions({2000, 5, 5, 5}));
  expect_no_pose(result);
  EXPECT_NE(result.reason.find("cable 1"), std::string::npos) << result.reason;
}

TEST(DirectFromTensions, RefusesWhatCannotBeTensions) {
  const Robot robot = irma4();
  EXPECT_THROW(direct_from_tensions(robot, tensions({100, 100, 100})), InputError);
  EXPECT_THROW(direct_from_tensions(robot, tensions({100, 100, 100, -1})), InputError);
  EXPECT_THROW(direct_from_tensions(robot, tensions({100, 100, 100, kNaN})), InputError);
  EXPECT_THROW(all_equilibria_from_tensions(robot, tensions({100})), InputError);
}

TEST(DirectFromTensions, AllEquilibriaAreDistinctBalancedAndClassified) {
  const Robot robot = irma4();
  const CableVector tension = kTable2[0].tension();
  const std::vector<EquilibriumResult> all = all_equilibria_from_tensions(robot, tension);
  ASSERT_GE(all.size(), 2U);  // the stable one, and at least one upside down
  EXPECT_LT(distance(all[0].pose, direct_from_tensions(robot, tension).pose), 1e-9);
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_LT(imbalance(robot, all[i].pose, tension), 1e-9 * robot.weight_N());
    const PlatformState state = platform_state(robot, all[i].pose);
    const Matrix6 k = stiffness(robot, state, tension);
    const bool positive = (0.5 * (k + k.transpose())).eval().llt().info() == Eigen::Success;
    EXPECT_EQ(all[i].stable, positive);
    EXPECT_EQ(all[i].status, positive ? EquilibriumStatus::found : EquilibriumStatus::unstable);
    if (i > 0) {
      EXPECT_LE(all[i].stable, all[i - 1].stable) << "stable ones come first";
    }
    for (std::size_t j = 0; j < i; ++j) EXPECT_GT(distance(all[i].pose, all[j].pose), 1e-6);
  }
  EXPECT_FALSE(all.back().stable);
}

TEST(DirectFromLengths, FindsThePoseThatTheTensionsGave) {
  Rng rng(6);
  int checked = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const int n = 2 + trial % 5;
    const Robot robot = random_robot(rng, n, trial % 2 == 0);
    const CableVector tension = carrying_tensions(rng, robot);
    const EquilibriumResult by_tension = direct_from_tensions(robot, tension);
    if (by_tension.status != EquilibriumStatus::found) continue;
    // Close by: the way back to the very pose, with the tensions as multipliers.
    const EquilibriumResult warm = direct_from_lengths(
        robot, by_tension.length_m, plus(by_tension.pose, Vector6::Constant(0.01)));
    ASSERT_EQ(warm.status, EquilibriumStatus::found) << n << " cables: " << warm.reason;
    EXPECT_LT(distance(warm.pose, by_tension.pose), 1e-8);
    EXPECT_LT((warm.tension_N - tension).norm(), 1e-6 * tension.norm());
    // From nothing: a rest with these lengths, if not always the same one.
    const EquilibriumResult cold = direct_from_lengths(robot, by_tension.length_m);
    ASSERT_TRUE(cold.balanced()) << cold.reason;
    EXPECT_LT(imbalance(robot, cold.pose, cold.tension_N), 1e-8 * robot.weight_N());
    EXPECT_LT((platform_state(robot, cold.pose).length_m() - by_tension.length_m).maxCoeff(), 1e-8);
    EXPECT_GE(cold.tension_N.minCoeff(), -1e-8 * robot.weight_N());
    ++checked;
  }
  EXPECT_GT(checked, 60);
}

TEST(DirectFromLengths, FindsEveryRowOfTable2FromItsLengths) {
  const Robot robot = irma4();
  for (const Table2Row& row : kTable2) {
    const EquilibriumResult by_tension = direct_from_tensions(robot, row.tension());
    const EquilibriumResult found = direct_from_lengths(robot, by_tension.length_m);
    ASSERT_EQ(found.status, EquilibriumStatus::found) << found.reason;
    EXPECT_LT(distance(found.pose, by_tension.pose), 1e-9);
    EXPECT_LT((found.tension_N - row.tension()).norm(), 1e-6);
    EXPECT_LT((found.length_m - by_tension.length_m).norm(), 1e-10);
  }
}

TEST(DirectFromLengths, ACableThatIsTooLongHangsLoose) {
  const Robot robot = irma4();
  CableVector length = direct_from_tensions(robot, kTable2[4].tension()).length_m;
  length[2] += 0.5;
  const EquilibriumResult found = direct_from_lengths(robot, length);
  ASSERT_EQ(found.status, EquilibriumStatus::slack) << found.reason;
  EXPECT_NE(found.reason.find("cable 3"), std::string::npos) << found.reason;
  EXPECT_EQ(found.tension_N[2], 0.0);
  EXPECT_LT(found.length_m[2], length[2]);
  for (const int taut : {0, 1, 3}) EXPECT_NEAR(found.length_m[taut], length[taut], 1e-9);
  EXPECT_GE(found.tension_N.minCoeff(), 0.0);
  EXPECT_LT(imbalance(robot, found.pose, found.tension_N), 1e-9 * robot.weight_N());
}

TEST(DirectFromLengths, OneShortCableCarriesAllTheWeight) {
  const Robot robot = irma4();
  const CableVector length = tensions({0.6, 5.0, 5.0, 5.0});
  const EquilibriumResult found = direct_from_lengths(robot, length);
  ASSERT_EQ(found.status, EquilibriumStatus::slack) << found.reason;
  EXPECT_NEAR(found.tension_N[0], robot.weight_N(), 1e-6);
  const PlatformState state = platform_state(robot, found.pose);
  EXPECT_NEAR(state.cable[0].direction.z(), -1.0, 1e-9);  // plumb
}

TEST(DirectFromLengths, CablesTooShortToMeetAreNotFound) {
  const EquilibriumResult result = direct_from_lengths(irma4(), tensions({0.5, 0.5, 0.5, 0.5}));
  expect_no_pose(result);
  EXPECT_NE(result.reason.find("too short"), std::string::npos) << result.reason;
}

TEST(DirectFromLengths, RefusesWhatCannotBeLengths) {
  const Robot robot = irma4();
  EXPECT_THROW(direct_from_lengths(robot, tensions({1, 1, 1})), InputError);
  EXPECT_THROW(direct_from_lengths(robot, tensions({1, 1, 1, 0})), InputError);
  EXPECT_THROW(direct_from_lengths(robot, tensions({1, 1, 1, kNaN})), InputError);
  Rng rng(7);
  EXPECT_THROW(direct_from_lengths(random_robot(rng, 7), CableVector::Ones(7)), InputError);
}

TEST(DirectFromLengths, AllEquilibriaHaveTheLengthsAndPull) {
  const Robot robot = irma4();
  const CableVector length = direct_from_tensions(robot, kTable2[4].tension()).length_m;
  const std::vector<EquilibriumResult> all = all_equilibria_from_lengths(robot, length);
  ASSERT_FALSE(all.empty());
  EXPECT_TRUE(all[0].stable);
  EXPECT_LT(distance(all[0].pose, direct_from_lengths(robot, length).pose), 1e-8);
  for (const EquilibriumResult& e : all) {
    EXPECT_LT(imbalance(robot, e.pose, e.tension_N), 1e-8 * robot.weight_N());
    EXPECT_LT((e.length_m - length).maxCoeff(), 1e-8);
    EXPECT_GE(e.tension_N.minCoeff(), -1e-8 * robot.weight_N());
  }
}

TEST(EquilibriumStatus, HasANameAndAnOrderOfPreference) {
  using enum EquilibriumStatus;
  const std::vector<std::pair<EquilibriumStatus, std::string>> names{
      {found, "found"},
      {obstructed, "obstructed"},
      {unstable, "unstable"},
      {infeasible, "infeasible"},
      {slack, "slack"},
      {not_found, "not_found"},
      {invalid_geometry, "invalid_geometry"}};
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(to_string(names[i].first), names[i].second);
    EXPECT_EQ(rank(names[i].first), static_cast<int>(i));
    EquilibriumResult result;
    result.status = names[i].first;
    EXPECT_EQ(result.balanced(), i < 5);
  }
}

// The two notions, against the dense ones of statics/wrench.hpp.
TEST(Stability, AgreesWithTheDenseStiffnesses) {
  Rng rng(8);
  int both[2] = {0, 0};
  for (int trial = 0; trial < 200; ++trial) {
    const Robot robot = random_robot(rng, 1 + trial % 8);
    const Pose pose = random_pose(rng, robot);
    const PlatformState state = platform_state(robot, pose);
    const CableVector tension = random_tensions(rng, robot);
    const Stability s = stability(robot, state, tension);
    const Eigen::MatrixXd free = free_motion_stiffness(robot, state, tension);
    const bool locked = free.rows() == 0 || free.llt().info() == Eigen::Success;
    EXPECT_EQ(s.locked_lengths_N_m > 0.0, locked);
    const Matrix6 full = stiffness(robot, state, tension);
    const Matrix6 symmetric = 0.5 * (full + full.transpose());
    const bool constant = symmetric.llt().info() == Eigen::Success;
    EXPECT_EQ(s.constant_tensions_N_m > 0.0, constant);
    EXPECT_EQ(stable_with_locked_lengths(state, full, 0.3), locked);
    EXPECT_EQ(stable_with_constant_tensions(symmetric, 0.3), constant);
    EXPECT_LE(s.constant_tensions_N_m, s.locked_lengths_N_m + 1e-9);
    ++both[locked];
  }
  EXPECT_GT(both[0], 20);  // the sample holds both kinds
  EXPECT_GT(both[1], 20);
}

}  // namespace
}  // namespace cdprcal
