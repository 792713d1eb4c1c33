// Inverse geometrico-static problem.
#include "cdprcal/equilibria/inverse.hpp"

#include <gtest/gtest.h>

#include "../support/table2.hpp"
#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/error.hpp"
#include "robots.hpp"

namespace cdprcal {
namespace {

using namespace test;  // NOLINT: test vocabulary
using D = TensionDistribution;

InverseOptions with(D distribution) {
  InverseOptions options;
  options.distribution = distribution;
  return options;
}

// See direct_test.cpp for why rows 1 to 4 are compared to 1.2e-5.
TEST(Inverse, FindsEveryRowOfTable2FromItsPositionAndLambda) {
  const Robot robot = irma4();
  for (std::size_t i = 0; i < kTable2.size(); ++i) {
    SCOPED_TRACE("row " + std::to_string(i + 1));
    const Pose pose = kTable2[i].pose();
    InverseOptions options = with(D::given_lambda);
    options.lambda_N = lambda_of(robot, platform_state(robot, pose), kTable2[i].tension());
    const InverseResult found = inverse(robot, pose.position_m, options);
    ASSERT_EQ(found.status, EquilibriumStatus::found) << found.reason;
    EXPECT_EQ(found.pose.position_m, pose.position_m);
    EXPECT_LT(rotation_distance_rad(found.pose, pose), i < 4 ? 1.2e-5 : 1e-6);
    EXPECT_LT((found.tension_N - kTable2[i].tension()).norm(), i < 4 ? 5e-4 : 1e-4);
    EXPECT_LT(imbalance(robot, found.pose, found.tension_N), 1e-9 * robot.weight_N());
    EXPECT_GT(found.margin_N, 0.0);
  }
}

TEST(Inverse, BalancesForAnyNumberOfCablesAndDistribution) {
  Rng rng(1);
  for (const int n : {3, 4, 5}) {
    const Robot robot = irma4_with_cables(n);
    const Vector3 centre = n == 3 ? Vector3(0.35, 0.35, 0.9) : Vector3(0.0, 0.0, 0.9);
    for (const D d : {D::barycentre, D::minimum_norm, D::mid_range}) {
      for (int trial = 0; trial < 10; ++trial) {
        const Vector3 position =
            centre + uniform_vector(rng, Vector3::Constant(-0.2), Vector3::Constant(0.2));
        const InverseResult found = inverse(robot, position, with(d));
        ASSERT_TRUE(found.balanced()) << n << ' ' << to_string(d) << ": " << found.reason;
        EXPECT_LT(imbalance(robot, found.pose, found.tension_N), 1e-9 * robot.weight_N());
        EXPECT_EQ(found.status == EquilibriumStatus::infeasible, found.margin_N < 0.0);
        EXPECT_NEAR(found.margin_N, tension_margin_N(robot, found.tension_N), 1e-9);
        ASSERT_EQ(found.lambda_N.size(), n - 3);
      }
    }
  }
}

TEST(Inverse, AgreesWithTheDirectProblem) {
  const Robot robot = irma4();
  Rng rng(2);
  for (int trial = 0; trial < 30; ++trial) {
    const Vector3 position = uniform_vector(rng, {-0.5, -0.5, 0.5}, {0.5, 0.5, 1.2});
    const InverseResult found = inverse(robot, position);
    ASSERT_EQ(found.status, EquilibriumStatus::found) << found.reason;
    const EquilibriumResult direct = direct_from_tensions(robot, found.tension_N, found.pose);
    EXPECT_LT(distance(direct.pose, found.pose), 1e-7);
  }
}

TEST(Inverse, AWarmStartGivesTheSameInAFewSteps) {
  const Robot robot = irma4();
  const InverseSolver solver(robot, {});
  Rng rng(3);
  for (int trial = 0; trial < 30; ++trial) {
    const Vector3 position = uniform_vector(rng, {-0.5, -0.5, 0.5}, {0.5, 0.5, 1.2});
    const InverseSolver::Point cold = solver.solve(position);
    ASSERT_EQ(cold.status, EquilibriumStatus::found);
    const Vector3 next = position + Vector3(0.02, -0.01, 0.01);
    const InverseSolver::Point warm = solver.continue_from(next, cold.rotation);
    ASSERT_EQ(warm.status, EquilibriumStatus::found);
    EXPECT_LE(warm.steps, 3);
    const InverseSolver::Point again = solver.solve(next);
    EXPECT_LT(rotation_distance_rad({next, warm.rotation}, {next, again.rotation}), 1e-8);
  }
}

TEST(Inverse, MirroredPositionsHaveMirroredEquilibria) {
  const Robot robot = symmetric_irma4();
  Rng rng(4);
  for (int trial = 0; trial < 20; ++trial) {
    const Vector3 position = uniform_vector(rng, {-0.6, -0.6, 0.4}, {0.6, 0.6, 1.3});
    const InverseResult found = inverse(robot, position);
    ASSERT_TRUE(found.balanced()) << found.reason;
    for (const int axis : {0, 1}) {
      const Pose mirror = mirrored(found.pose, axis);
      const InverseResult other = inverse(robot, mirror.position_m);
      ASSERT_EQ(other.status, found.status);
      EXPECT_LT(distance(other.pose, mirror), 1e-7);
      EXPECT_LT((other.tension_N - mirrored(found.tension_N, axis)).norm(), 1e-5);
    }
  }
}

TEST(Inverse, ScalingMassAndLimitsScalesTheTensions) {
  Robot robot = irma4();
  const Vector3 position(0.3, -0.2, 0.8);
  for (const D d : {D::barycentre, D::minimum_norm, D::mid_range}) {
    const InverseResult light = inverse(robot, position, with(d));
    Robot heavy = robot;
    heavy.platform.mass_kg *= 2.5;
    heavy.tension_min_N *= 2.5;
    heavy.tension_max_N *= 2.5;
    const InverseResult other = inverse(heavy, position, with(d));
    ASSERT_EQ(light.status, other.status);
    EXPECT_LT(distance(light.pose, other.pose), 1e-8);
    EXPECT_LT((other.tension_N - 2.5 * light.tension_N).norm(), 1e-6);
  }
}

TEST(Inverse, ATurnedRobotHasTurnedEquilibria) {
  const Robot robot = irma4();
  Rng rng(5);
  for (int trial = 0; trial < 20; ++trial) {
    const double angle = uniform(rng, -kPi, kPi);
    const Vector3 position = uniform_vector(rng, {-0.6, -0.6, 0.4}, {0.6, 0.6, 1.3});
    const InverseResult found = inverse(robot, position);
    const Pose expected = turned(found.pose, angle);
    const InverseResult other = inverse(turned(robot, angle), expected.position_m);
    ASSERT_EQ(other.status, found.status);
    if (!found.balanced()) continue;
    EXPECT_LT(distance(other.pose, expected), 1e-7);
    EXPECT_LT((other.tension_N - found.tension_N).norm(), 1e-5);
  }
}

TEST(Inverse, TensionLimitsDecideFeasibility) {
  Robot robot = irma4();
  robot.tension_min_N = 20.0;
  robot.tension_max_N = 25.0;  // four of these are less than the weight
  const InverseResult found = inverse(robot, {0.0, 0.0, 0.9});
  EXPECT_EQ(found.status, EquilibriumStatus::infeasible);
  EXPECT_LT(found.margin_N, 0.0);
  EXPECT_FALSE(found.reason.empty());
}

TEST(Inverse, WhereNothingBalancesThereIsNoPose) {
  const Robot robot = irma4();
  const InverseResult high = inverse(robot, {0.0, 0.0, 3.0});  // above the pulleys
  EXPECT_NE(high.status, EquilibriumStatus::found);
  const InverseResult inside =  // every anchor ring around a pulley: no tangent
      inverse(robot, robot.cables[0].pulley.position_m + Vector3(0.0, 0.0, 5.0));
  EXPECT_NE(inside.status, EquilibriumStatus::found);
  for (const InverseResult& r : {high, inside}) {
    EXPECT_FALSE(r.reason.empty());
    if (!r.balanced()) {
      EXPECT_TRUE(r.pose.rotation.coeffs().array().isNaN().all());
    }
  }
}

TEST(Inverse, AllEquilibriaAtAPositionIncludeTheStableOne) {
  const Robot robot = irma4();
  const Vector3 position(0.2, 0.1, 0.9);
  const std::vector<InverseResult> all = all_equilibria_at(robot, position);
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(all[0].status, EquilibriumStatus::found);
  bool included = false;
  for (const InverseResult& e : all) {
    EXPECT_LT(imbalance(robot, e.pose, e.tension_N), 1e-9 * robot.weight_N());
    included = included || distance(e.pose, inverse(robot, position).pose) < 1e-6;
  }
  EXPECT_TRUE(included);
}

TEST(Inverse, TheStabilityNotionIsAChoice) {
  // Constant tensions demand more than locked lengths: found under the first implies the second.
  const Robot robot = irma4();
  InverseOptions strict;
  strict.stability = StabilityNotion::constant_tensions;
  Rng rng(6);
  for (int trial = 0; trial < 60; ++trial) {
    const Vector3 position = uniform_vector(rng, {-1.0, -1.1, 0.1}, {1.0, 1.1, 1.5});
    if (inverse(robot, position, strict).status == EquilibriumStatus::found) {
      EXPECT_EQ(inverse(robot, position).status, EquilibriumStatus::found);
    }
  }
}

TEST(Inverse, IsDefinedForThreeToFiveCablesOnly) {
  Rng rng(7);
  for (const int n : {1, 2}) {
    try {
      inverse(random_robot(rng, n), {0.0, 0.0, 1.0});
      FAIL() << n << " cables were accepted";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("not " + std::to_string(n)), std::string::npos);
    }
  }
}

TEST(Inverse, RefusesWhatMakesNoSense) {
  const Robot robot = irma4();
  EXPECT_THROW(inverse(robot, {kNaN, 0.0, 1.0}), InputError);
  InverseOptions options = with(D::given_lambda);
  EXPECT_THROW(inverse(robot, {0.0, 0.0, 1.0}, options), InputError);  // λ is missing
  options.lambda_N = CableVector::Zero(2);
  EXPECT_THROW(inverse(robot, {0.0, 0.0, 1.0}, options), InputError);  // one too many
  Robot limits = robot;
  limits.tension_max_N = limits.tension_min_N;
  EXPECT_THROW(inverse(limits, {0.0, 0.0, 1.0}), InputError);
  Robot many = robot;
  many.cables.resize(12, robot.cables[0]);
  EXPECT_THROW(inverse(many, {0.0, 0.0, 1.0}), InputError);
}

}  // namespace
}  // namespace cdprcal
