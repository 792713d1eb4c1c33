// Tension distributions against their definitions.
#include "cdprcal/equilibria/distribution.hpp"

#include <gtest/gtest.h>

#include "../support/numeric_jacobian.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/equilibria/inverse.hpp"
#include "cdprcal/error.hpp"
#include "robots.hpp"

namespace cdprcal {
namespace {

using namespace test;  // NOLINT: test vocabulary
using D = TensionDistribution;

struct Case {
  Robot robot;
  PlatformState state;
  Pose pose;
};

/// A pose near where irma4 (and its 3- and 5-cable siblings) hangs, tilted at random.
Case random_case(Rng& rng, int cables) {
  Case c{irma4_with_cables(cables), {}, {}};
  c.pose = {uniform_vector(rng, {-0.6, -0.6, 0.4}, {0.6, 0.6, 1.3}),
            exp_so3(uniform_vector(rng, Vector3::Constant(-0.3), Vector3::Constant(0.3)))};
  c.state = platform_state(c.robot, c.pose);
  return c;
}

Vector3 force_error(const Case& c, const CableVector& tension) {
  return wrench_residual(c.robot, c.state, tension).head<3>();
}

TEST(TensionFamily, HoldsAllTensionsThatCarryTheWeight) {
  Rng rng(1);
  for (int trial = 0; trial < 60; ++trial) {
    const int n = 3 + trial % 3;
    const Case c = random_case(rng, n);
    const TensionFamily family = force_family(c.robot, c.state);
    ASSERT_TRUE(family.valid);
    const Eigen::MatrixXd a = structure_matrix(c.state).topRows<3>();
    const Eigen::VectorXd least = least_norm(a, Eigen::VectorXd(c.robot.gravity_force_N()));
    EXPECT_LT((family.minimum_norm_N - least).norm(), 1e-9);
    ASSERT_EQ(family.basis.cols(), n - 3);
    EXPECT_LT((a * family.basis).norm(), 1e-12);
    EXPECT_LT(
        (family.basis.transpose() * family.basis - Eigen::MatrixXd::Identity(n - 3, n - 3)).norm(),
        1e-12);
    for (int col = 0; col < n - 3; ++col) {  // the documented rule
      EXPECT_GT(family.basis(3 + col, col), 0.0);
      for (int above = 0; above < col; ++above)
        EXPECT_NEAR(family.basis(3 + above, col), 0.0, 1e-12);
    }
  }
}

TEST(TensionFamily, LambdaReproducesItsTensions) {
  Rng rng(2);
  for (int trial = 0; trial < 60; ++trial) {
    const int n = 3 + trial % 3;
    const Case c = random_case(rng, n);
    const CableVector lambda =
        CableVector::NullaryExpr(n - 3, [&] { return uniform(rng, -50, 50); });
    const DistributedTension t = distribute(c.robot, c.state, D::given_lambda, lambda);
    ASSERT_TRUE(t.valid);
    EXPECT_LT(force_error(c, t.tension_N).norm(), 1e-9);
    EXPECT_LT((lambda_of(c.robot, c.state, t.tension_N) - lambda).norm(), 1e-9);
    EXPECT_LT((t.lambda_N - lambda).norm(), 1e-9);
  }
}

TEST(TensionFamily, TheBasisMovesContinuously) {
  Rng rng(3);
  for (int n : {4, 5}) {
    const Case c = random_case(rng, n);
    const Vector6 direction = Vector6::NullaryExpr([&] { return uniform(rng, -1.0, 1.0); });
    NullBasis previous = force_family(c.robot, c.state).basis;
    for (int k = 1; k <= 200; ++k) {
      const Pose pose = plus(c.pose, Vector6(1e-3 * k * direction));
      const NullBasis basis = force_family(c.robot, platform_state(c.robot, pose)).basis;
      EXPECT_LT((basis - previous).norm(), 0.02);
      previous = basis;
    }
  }
}

TEST(TensionFamily, IsNotValidWhenTheCablesAreCoplanar) {
  Robot robot = irma4_with_cables(3);
  for (Cable& cable : robot.cables) {
    cable.pulley.position_m.y() = 0.0;
    cable.platform_anchor_m.y() = 0.0;
    cable.pulley.radius_m = 0.0;
  }
  robot.cables[1].pulley.position_m.x() = 0.3;
  const PlatformState state =
      platform_state(robot, {{0.1, 0.0, 0.8}, Eigen::Quaterniond::Identity()});
  ASSERT_TRUE(state.valid);
  EXPECT_FALSE(force_family(robot, state).valid);
  EXPECT_FALSE(distribute(robot, state, D::minimum_norm, {}).valid);
}

TEST(Distribution, MidRangeIsTheClosestToTheMiddle) {
  Rng rng(4);
  for (int trial = 0; trial < 30; ++trial) {
    const Case c = random_case(rng, 4 + trial % 2);
    const double middle = 0.5 * (c.robot.tension_min_N + c.robot.tension_max_N);
    const DistributedTension t = distribute(c.robot, c.state, D::mid_range, {});
    EXPECT_LT(force_error(c, t.tension_N).norm(), 1e-9);
    // What is left is orthogonal to every way of changing it.
    const TensionFamily family = force_family(c.robot, c.state);
    const Eigen::VectorXd rest = t.tension_N.array() - middle;
    EXPECT_LT((family.basis.transpose() * rest).norm(), 1e-9);
  }
}

/// Centroid of the feasible set by counting a fine lattice of λ.
Eigen::Vector2d counted_centroid(const Case& c, const TensionFamily& family, double reach,
                                 int lattice) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double count = 0.0;
  const int k = static_cast<int>(family.basis.cols());
  for (int i = 0; i < lattice; ++i) {
    for (int j = 0; j < (k == 2 ? lattice : 1); ++j) {
      Eigen::Vector2d lambda(reach * ((2.0 * i + 1.0) / lattice - 1.0),
                             k == 2 ? reach * ((2.0 * j + 1.0) / lattice - 1.0) : 0.0);
      const CableVector tension = family.minimum_norm_N + family.basis * lambda.head(k);
      if (tension_margin_N(c.robot, tension) < 0.0) continue;
      sum += lambda;
      count += 1.0;
    }
  }
  return sum / count;
}

TEST(Distribution, BarycentreIsTheCentroidOfTheFeasiblePolytope) {
  Rng rng(5);
  int checked = 0;
  for (int trial = 0; trial < 16; ++trial) {
    const int n = 4 + trial % 2;
    Case c = random_case(rng, n);
    c.robot.tension_min_N = 1.0;
    c.robot.tension_max_N = uniform(rng, 80.0, 400.0);
    const DistributedTension t = distribute(c.robot, c.state, D::barycentre, {});
    if (!t.polytope_exists) continue;
    ++checked;
    EXPECT_LT(force_error(c, t.tension_N).norm(), 1e-9);
    EXPECT_GE(tension_margin_N(c.robot, t.tension_N), 0.0);  // convex: the centroid is inside
    const double reach = 1000.0;
    const int lattice = n == 4 ? 200000 : 1500;
    const Eigen::Vector2d counted =
        counted_centroid(c, force_family(c.robot, c.state), reach, lattice);
    for (int k = 0; k < n - 3; ++k) {
      EXPECT_NEAR(t.lambda_N[k], counted[k], n == 4 ? 0.02 : 0.5) << "n = " << n;
    }
  }
  EXPECT_GT(checked, 8);
}

TEST(Distribution, AnEmptyPolytopeIsSaidAndMissedByLeast) {
  Rng rng(6);
  for (int trial = 0; trial < 20; ++trial) {
    Case c = random_case(rng, 5);
    c.robot.tension_min_N = 18.0;
    c.robot.tension_max_N = 20.0;  // five of these cannot carry 127 N
    const DistributedTension t = distribute(c.robot, c.state, D::barycentre, {});
    ASSERT_TRUE(t.valid);
    EXPECT_FALSE(t.polytope_exists);
    const double margin = tension_margin_N(c.robot, t.tension_N);
    EXPECT_LT(margin, 0.0);
    const TensionFamily family = force_family(c.robot, c.state);
    for (int k = 0; k < 200; ++k) {  // no λ near or far does better
      const double size = std::pow(10.0, uniform(rng, -3.0, 2.0));
      const Eigen::Vector2d step = size * Eigen::Vector2d(uniform(rng, -1, 1), uniform(rng, -1, 1));
      EXPECT_LE(tension_margin_N(c.robot, t.tension_N + CableVector(family.basis * step)),
                margin + 1e-9);
    }
  }
}

Pose displaced(const Pose& pose, const Eigen::VectorXd& turn) {
  Vector6 twist;
  twist << Vector3::Zero(), turn;
  return plus(pose, twist);
}

TEST(Distribution, DerivativesAgreeWithNumericOnes) {
  Rng rng(7);
  for (const int n : {3, 4, 5}) {
    for (const D d : {D::barycentre, D::minimum_norm, D::mid_range, D::given_lambda}) {
      for (const double highest : {400.0, 30.0}) {  // a polytope, and none
        Case c = random_case(rng, n);
        c.robot.tension_max_N = highest;
        SCOPED_TRACE(std::to_string(n) + " cables, " + to_string(d) + ", maximum " +
                     std::to_string(highest));
        const CableVector lambda = CableVector::Constant(n - 3, 11.0);
        const DistributedTension t = distribute(c.robot, c.state, d, lambda);
        ASSERT_TRUE(t.valid);
        const auto numeric = numeric_tangent_jacobian(
            [&](const Eigen::VectorXd& turn) {
              const PlatformState there = platform_state(c.robot, displaced(c.pose, turn));
              return Eigen::VectorXd(distribute(c.robot, there, d, lambda).tension_N);
            },
            3, 1e-4);
        EXPECT_TRUE(jacobian_matches(t.by_rotation, numeric, 1e-6));
      }
    }
  }
}

TEST(Distribution, TheMomentOfEquationA1HasItsDerivatives) {
  Rng rng(8);
  for (const int n : {3, 4, 5}) {
    for (const D d : {D::barycentre, D::minimum_norm}) {
      const Case c = random_case(rng, n);
      InverseOptions options;
      options.distribution = d;
      const InverseSolver solver(c.robot, options);
      const InverseSolver::Moment m = solver.moment(c.state);
      ASSERT_TRUE(m.valid);
      EXPECT_LT((m.value - wrench_residual(c.robot, c.state, m.tension.tension_N).tail<3>()).norm(),
                1e-10);
      const auto numeric = numeric_tangent_jacobian(
          [&](const Eigen::VectorXd& turn) {
            const PlatformState there = platform_state(c.robot, displaced(c.pose, turn));
            return Eigen::VectorXd(solver.moment(there).value);
          },
          3, 1e-4);
      EXPECT_TRUE(jacobian_matches(m.by_rotation, numeric, 1e-6));
    }
  }
}

TEST(Distribution, NamesGoBothWays) {
  for (const D d : {D::barycentre, D::minimum_norm, D::mid_range, D::given_lambda}) {
    EXPECT_EQ(parse_tension_distribution(to_string(d)), d);
  }
  EXPECT_THROW(parse_tension_distribution("centroid"), InputError);
}

TEST(Distribution, TensionsAreOneACable) {
  Rng rng(46);
  const Case c = random_case(rng, 4);
  for (const int size : {0, 2, 5}) {
    EXPECT_THROW(lambda_of(c.robot, c.state, CableVector::Ones(size)), InputError);
    EXPECT_THROW(tension_margin_N(c.robot, CableVector::Ones(size)), InputError);
  }
}

}  // namespace
}  // namespace cdprcal
