// Six cables and more: tensions at a commanded pose, and how the platform is led from pose to pose.
#include "cdprcal/equilibria/wrench_distribution.hpp"
#include "cdprcal/decompositions.hpp"

#include "../support/cells.hpp"
#include "cdprcal/equilibria/held_motion.hpp"
#include "cdprcal/equilibria/inverse.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/geometry/fifth_degree.hpp"
#include "robots.hpp"

namespace cdprcal::test {
namespace {

using D = TensionDistribution;

/// A random robot of n cables at a comfortable pose.
struct Drawn {
  Robot robot;
  Pose pose;
  PlatformState state;
};
Drawn draw(Rng& rng, int cables) {
  for (;;) {
    Drawn d;
    d.robot = random_robot(rng, cables);
    d.pose = {uniform_vector(rng, {-1.0, -1.0, 0.3}, {1.0, 1.0, 1.3}),
              exp_so3(uniform_vector(rng, Vector3::Constant(-0.4), Vector3::Constant(0.4)))};
    if (!is_comfortable(d.robot, d.pose)) continue;
    d.state = platform_state(d.robot, d.pose);
    return d;
  }
}

TEST(WrenchDistribution, EveryTensionOfTheFamilyCarriesTheWeight) {
  Rng rng(3);
  for (int trial = 0; trial < 200; ++trial) {
    const int n = 6 + trial % 3;
    const Drawn d = draw(rng, n);
    const TensionFamily family = wrench_family(d.robot, d.state);
    ASSERT_TRUE(family.valid);
    ASSERT_EQ(family.basis.cols(), n - 6);
    const Eigen::MatrixXd gram = family.basis.transpose() * family.basis;
    EXPECT_LT((gram - Eigen::MatrixXd::Identity(n - 6, n - 6)).norm(), 1e-9);
    CableVector lambda(n - 6);
    for (double& value : lambda) value = uniform(rng, -500.0, 500.0);
    CableVector tension = family.minimum_norm_N;
    if (n > 6) tension += family.basis * lambda;
    const double scale = d.robot.weight_N() + tension.norm();
    EXPECT_LT(wrench_residual(d.robot, d.state, tension).norm(), 1e-8 * scale);
    EXPECT_LT((balanced_near(d.robot, d.state, tension) - tension).norm(), 1e-8 * scale);
    EXPECT_LT((lambda_of(d.robot, d.state, tension) - lambda).norm(), 1e-7 * scale);
  }
}

TEST(WrenchDistribution, TheBarycentreIsThereExactlyWherePolytopesAre) {
  // Held against a dense scan of λ, which knows nothing of half planes.
  Rng rng(5);
  int feasible = 0, empty = 0;
  for (int trial = 0; trial < 120; ++trial) {
    const int n = 7 + trial % 2;
    // Some of these poses are held and some are not; so are seven of the eight cables.
    const bool hangs = trial % 4 < 2;
    Drawn d;
    d.robot = hangs ? load_robot("posts8") : eight_cable_cell();
    d.pose = {uniform_vector(rng, {-1.2, -1.0, 0.3}, {1.2, 1.0, 2.0}),
              exp_so3({uniform(rng, -0.3, 0.3), uniform(rng, -0.3, 0.3),
                       (hangs ? -0.7 : 0.0) + uniform(rng, -0.4, 0.4)})};
    if (n == 7) d.robot.cables.pop_back();
    d.state = platform_state(d.robot, d.pose);
    ASSERT_TRUE(d.state.valid);
    const TensionFamily family = wrench_family(d.robot, d.state);
    const DistributedTension found = distribute_wrench(d.robot, d.state, D::barycentre);
    ASSERT_TRUE(found.valid);
    EXPECT_LT(wrench_residual(d.robot, d.state, found.tension_N).norm(),
              1e-7 * (d.robot.weight_N() + found.tension_N.norm()));
    const double reach = std::sqrt(8.0) * d.robot.tension_max_N;
    double best = -HUGE_VAL;
    CableVector sum = CableVector::Zero(n);
    int inside = 0;
    const int steps = n == 7 ? 20001 : 401;
    for (int a = 0; a < steps; ++a) {
      for (int b = 0; b < (n == 7 ? 1 : steps); ++b) {
        CableVector lambda(n - 6);
        lambda[0] = reach * (2.0 * a / (steps - 1) - 1.0);
        if (n == 8) lambda[1] = reach * (2.0 * b / (steps - 1) - 1.0);
        const CableVector tension = family.minimum_norm_N + family.basis * lambda;
        const double margin = tension_margin_N(d.robot, tension);
        best = std::max(best, margin);
        if (margin < 0.0) continue;
        sum += tension;
        ++inside;
      }
    }
    const double step = 2.0 * reach / (steps - 1);
    if (best > 0.0) {
      EXPECT_TRUE(found.polytope_exists);
      EXPECT_GE(tension_margin_N(d.robot, found.tension_N), -1e-9);
      ++feasible;
      if (inside > 500) {
        EXPECT_LT((sum / inside - found.tension_N).norm(), 4.0 * step);
      }
    } else if (best < -step) {
      EXPECT_FALSE(found.polytope_exists);
      // The limits are missed by no more than anywhere in the scan.
      if (n == 8) {
        EXPECT_GE(tension_margin_N(d.robot, found.tension_N), best - 1e-9);
      }
      ++empty;
    }
  }
  EXPECT_GT(feasible, 10);
  EXPECT_GT(empty, 10);
}

TEST(WrenchDistribution, SixCablesLeaveNothingToChoose) {
  Rng rng(8);
  const Drawn d = draw(rng, 6);
  const CableVector tension = distribute_wrench(d.robot, d.state, D::minimum_norm).tension_N;
  for (const D distribution : {D::barycentre, D::mid_range, D::given_lambda}) {
    EXPECT_EQ(distribute_wrench(d.robot, d.state, distribution, CableVector()).tension_N, tension);
  }
}

TEST(HeldOrientation, IsTheFilesOwnWhereThatReachesAsFar) {
  const Robot cell = eight_cable_cell();
  EXPECT_EQ(held_orientation(cell).coeffs(), Eigen::Quaterniond::Identity().coeffs());
  // posts8 holds next to nothing with its platform frame along the world's.
  const Robot posts = load_robot("posts8");
  const Eigen::Quaterniond turn = held_orientation(posts);
  EXPECT_GT(std::abs(log_so3(turn).z()), 20.0 * kDegree);
  EXPECT_LT(log_so3(turn).head<2>().norm(), 1e-9) << "about the vertical";
  // And turns along with the installation.
  const Robot other = turned(posts, 0.3);
  Pose same{Vector3::Zero(), exp_so3({0.0, 0.0, 0.3}) * turn};
  EXPECT_LT(rotation_distance_rad({Vector3::Zero(), held_orientation(other)}, same), 4.0 * kDegree);
}

TEST(InverseFromSixCables, KeepsTheCommandedOrientation) {
  const Robot robot = load_robot("posts8");
  const Vector3 position(0.1, -0.1, 1.1);
  const InverseResult found = inverse(robot, position);
  ASSERT_EQ(found.status, EquilibriumStatus::found) << found.reason;
  EXPECT_EQ(found.pose.position_m, position);
  EXPECT_EQ(found.pose.rotation.coeffs(), held_orientation(robot).coeffs());
  EXPECT_GT(found.margin_N, 0.0);
  EXPECT_LT(found.residual_N, 1e-6);
  EXPECT_TRUE(std::isinf(found.stability.locked_lengths_N_m));
  InverseOptions options;
  options.rotation = exp_so3({0.05, -0.03, -0.7});
  EXPECT_EQ(inverse(robot, position, options).pose.rotation.coeffs(), options.rotation->coeffs());
  options.distribution = D::given_lambda;
  options.lambda_N = found.lambda_N;
  options.rotation.reset();
  EXPECT_LT((inverse(robot, position, options).tension_N - found.tension_N).norm(), 1e-6);
  options.lambda_N = CableVector::Zero(5);  // n − 3
  EXPECT_THROW(inverse(robot, position, options), InputError);
  InverseOptions of_four;
  of_four.rotation = Eigen::Quaterniond::Identity();
  EXPECT_THROW(inverse(irma4(), position, of_four), InputError);
}

TEST(HeldMotion, GoesStraightAndKeepsTheBalance) {
  const Robot robot = eight_cable_cell();
  InverseOptions turned_too;
  turned_too.rotation = exp_so3({0.02, 0.05, 0.1});
  const InverseResult a = inverse(robot, {-0.3, 0.2, 1.2});
  const InverseResult b = inverse(robot, {0.4, -0.1, 1.7}, turned_too);
  ASSERT_EQ(a.status, EquilibriumStatus::found);
  ASSERT_EQ(b.status, EquilibriumStatus::found);
  const HeldMotion motion(a.pose, a.tension_N, b.pose, b.tension_N);
  for (int k = 0; k <= 20; ++k) {
    const double s = k / 20.0;
    const HeldPoint at = held_point(robot, motion, s);
    EXPECT_LT((at.pose.position_m - ((1.0 - s) * a.pose.position_m + s * b.pose.position_m)).norm(),
              1e-12);
    EXPECT_LT(wrench_residual(robot, at.state, at.tension_N).norm(), 1e-6);
  }
  EXPECT_LT((held_point(robot, motion, 0.0).tension_N - a.tension_N).norm(), 1e-6);
  EXPECT_LT((held_point(robot, motion, 1.0).tension_N - b.tension_N).norm(), 1e-6);
  EXPECT_LT(minus(held_point(robot, motion, 1.0).pose, b.pose).norm(), 1e-12);
}

TEST(HeldMotion, AWayIsSlowEnoughForItsWeakestCable) {
  const Robot robot = load_robot("posts8");
  const InverseResult a = inverse(robot, {-0.4, -0.2, 0.6}), b = inverse(robot, {-0.4, 0.2, 0.6});
  const HeldMotion motion(a.pose, a.tension_N, b.pose, b.tension_N);
  const double time_s = least_time_by_tension_s(robot, motion);
  // What the platform's mass and inertia ask for on the way, as tensions of the least norm.
  double largest = 0.0;
  for (int k = 0; k <= 200; ++k) {
    const double x = k / 200.0;
    const HeldPoint at = held_point(robot, motion, FifthDegree::value(x));
    const Vector6 acceleration = FifthDegree::acceleration(x) / (time_s * time_s) * motion.twist;
    const Vector3 arm = at.state.centre_of_mass_arm_m;
    const Vector3 force =
        robot.platform.mass_kg * (acceleration.head<3>() + acceleration.tail<3>().cross(arm));
    ASSERT_LT(acceleration.tail<3>().norm(), 1e-9);  // it does not turn
    Vector6 wrench;
    wrench << force, arm.cross(force);
    const Eigen::MatrixXd structure = structure_matrix(at.state);
    const Eigen::VectorXd change = least_norm(structure, Eigen::VectorXd(wrench));
    largest = std::max(largest, (change.array().abs() / at.tension_N.array()).maxCoeff());
  }
  EXPECT_NEAR(largest, 0.125, 0.005);
  // Standing still takes no time.
  EXPECT_EQ(least_time_by_tension_s(robot, {a.pose, a.tension_N, a.pose, a.tension_N}), 0.0);
}

TEST(HeldMotion, CablesLedByTensionChangeOnlyForMuchBetterOnes) {
  const Robot robot = load_robot("hang4");
  const auto at = [](double x, double y) {
    return Pose{{x, y, 0.5}, Eigen::Quaterniond::Identity()};
  };
  const std::vector<int> here = cables_led_by_tension(robot, {at(0.02, 0.05)});
  ASSERT_EQ(here.size(), 1u);
  EXPECT_EQ(cables_led_by_tension(robot, {at(0.04, 0.06)}, here), here);
  // Not where the cable that leads now has no say.
  int changed = 0;
  for (const double x : {-0.3, 0.3}) {
    for (const double y : {-0.33, 0.43}) {
      changed += cables_led_by_tension(robot, {at(x, y)}, here) != here ? 1 : 0;
    }
  }
  EXPECT_GT(changed, 0);
  EXPECT_LT(changed, 4);
}

TEST(HeldMotion, SixCablesHoldThePoseWithoutThoseLedByTension) {
  for (const Robot& robot : {load_robot("posts8"), eight_cable_cell()}) {
    SCOPED_TRACE(robot.name);
    const Pose pose = inverse(robot, {0.05, 0.05, 1.2}).pose;
    const std::vector<int> led = cables_led_by_tension(robot, {pose});
    ASSERT_EQ(led.size(), 2u);
    // No other pair leaves six cables with a larger determinant: Jacobi's complementary minors.
    const CableJacobian lengths = length_jacobian(platform_state(robot, pose));
    const auto left = [&](int a, int b) {
      Matrix6 six;
      int row = 0;
      for (int i = 0; i < 8; ++i) {
        if (i != a && i != b) six.row(row++) = lengths.row(i);
      }
      return std::abs(six.determinant());
    };
    for (int a = 0; a < 8; ++a) {
      for (int b = a + 1; b < 8; ++b) {
        EXPECT_LE(left(a, b), left(led[0], led[1]) * (1.0 + 1e-6));
      }
    }
  }
  Rng rng(2);
  EXPECT_TRUE(cables_led_by_tension(random_robot(rng, 6), {}).empty());
}

}  // namespace
}  // namespace cdprcal::test
