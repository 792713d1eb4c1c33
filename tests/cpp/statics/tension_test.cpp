#include "cdprcal/statics/tension.hpp"

#include <gtest/gtest.h>

#include <Eigen/SVD>

#include "../support/numeric_jacobian.hpp"
#include "../support/random_robot.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal {
namespace {

using test::derivative_cases;
using test::jacobian_matches;
using test::numeric_pose_jacobian;

/// The wrench in Euler-rate coordinates: Dᵀ w with D = diag(I, H).
Vector6 euler_rate_wrench(const Robot& robot, const PlatformState& state, const Vector6& wrench) {
  const Matrix3 h = euler_rate_matrix(euler_from_rotation(state.rotation, robot.euler_convention),
                                      robot.euler_convention);
  Vector6 result;
  result << wrench.head<3>(), h.transpose() * wrench.tail<3>();
  return result;
}

/// How many times smaller a step must be for the numeric derivative near a singularity.
double conditioning(const TensionModel& model) {
  return std::max(1.0, model.by_twist.norm() / model.tension_N.norm());
}

TEST(LeftInverse, TensionsBalanceTheChosenRows) {
  int tested = 0;
  for (const auto& [robot, pose, label] : derivative_cases(6)) {
    SCOPED_TRACE(label);
    const PlatformState state = platform_state(robot, pose);
    const std::vector<WrenchRow> rows = left_inverse_rows(robot.cable_count());
    const TensionModel model = tensions_left_inverse(robot, state, rows);
    ASSERT_TRUE(model.valid);
    const Vector6 left =
        euler_rate_wrench(robot, state, wrench_residual(robot, state, model.tension_N));
    for (const WrenchRow row : rows) {
      EXPECT_NEAR(left[static_cast<int>(row)], 0.0, 1e-10 * model.tension_N.norm());
    }
    ++tested;
  }
  EXPECT_EQ(tested, 72);
}

TEST(LeftInverse, DerivativeByTwist) {
  for (const auto& [robot, pose, label] : derivative_cases(6)) {
    SCOPED_TRACE(label);
    const std::vector<WrenchRow> rows = left_inverse_rows(robot.cable_count());
    const TensionModel model = tensions_left_inverse(robot, platform_state(robot, pose), rows);
    ASSERT_TRUE(model.valid);
    const auto numeric = numeric_pose_jacobian(
        [&](const Pose& p) {
          return tensions_left_inverse(robot, platform_state(robot, p), rows).tension_N;
        },
        pose, 1e-2 / conditioning(model));
    EXPECT_TRUE(jacobian_matches(model.by_twist, numeric, 1e-7));
  }
}

TEST(LeftInverse, DerivativeByTwistForEveryChoiceOfRows) {
  test::Rng rng(51);
  int tested = 0;
  for (int n = 1; n <= 6; ++n) {
    const Robot robot = test::random_robot(rng, n);
    const Pose pose = test::random_pose(rng, robot);
    for (unsigned choice = 0; choice < 64; ++choice) {
      std::vector<WrenchRow> rows;
      for (int row = 0; row < 6; ++row) {
        if ((choice >> row & 1U) != 0) rows.push_back(static_cast<WrenchRow>(row));
      }
      if (static_cast<int>(rows.size()) != n) continue;
      const TensionModel model = tensions_left_inverse(robot, platform_state(robot, pose), rows);
      ASSERT_TRUE(model.valid);
      const auto numeric = numeric_pose_jacobian(
          [&](const Pose& p) {
            return tensions_left_inverse(robot, platform_state(robot, p), rows).tension_N;
          },
          pose, 1e-2 / conditioning(model));
      EXPECT_TRUE(jacobian_matches(model.by_twist, numeric, 1e-7))
          << n << " cables, rows " << choice;
      ++tested;
    }
  }
  EXPECT_EQ(tested, 63);
}

TEST(LeftInverse, RecordedRowsOfFourCables) {
  const std::vector<WrenchRow> expected{WrenchRow::force_x, WrenchRow::force_y, WrenchRow::force_z,
                                        WrenchRow::moment_yaw};
  EXPECT_EQ(left_inverse_rows(4), expected);
  EXPECT_EQ(left_inverse_rows(6).size(), 6U);
  EXPECT_THROW(left_inverse_rows(7), InputError);
  EXPECT_THROW(left_inverse_rows(0), InputError);
}

TEST(LeftInverse, SingularRowsAreInvalidNotPlausible) {
  // The literal first four rows of eq. 12 on the symmetry axis of a symmetric robot.
  Robot robot = load_robot("irma4");
  for (Cable& cable : robot.cables) {
    cable.pulley.position_m.x() = std::copysign(1.065, cable.pulley.position_m.x());
  }
  const PlatformState state =
      platform_state(robot, {{0.0, 0.0, 1.0}, Eigen::Quaterniond::Identity()});
  const std::vector<WrenchRow> first{WrenchRow::force_x, WrenchRow::force_y, WrenchRow::force_z,
                                     WrenchRow::moment_roll};
  EXPECT_FALSE(tensions_left_inverse(robot, state, first).valid);
  EXPECT_TRUE(tensions_left_inverse(robot, state, left_inverse_rows(4)).valid);
  const std::vector<WrenchRow> twice{WrenchRow::force_x, WrenchRow::force_x, WrenchRow::force_z,
                                     WrenchRow::moment_yaw};
  EXPECT_FALSE(tensions_left_inverse(robot, state, twice).valid);
  EXPECT_THROW(tensions_left_inverse(robot, state, left_inverse_rows(3)), InputError);
}

TEST(LeftInverse, MoreCablesThanRowsOfAWrenchHaveNone) {
  test::Rng rng(54);
  std::vector<WrenchRow> rows = left_inverse_rows(6);
  for (const int n : {7, 8}) {
    rows.push_back(WrenchRow::force_z);  // as many as cables, one more than once
    const Robot robot = test::random_robot(rng, n);
    const PlatformState state = platform_state(robot, test::random_pose(rng, robot));
    ASSERT_TRUE(state.valid);
    EXPECT_FALSE(tensions_left_inverse(robot, state, rows).valid);
  }
}

TEST(LeastSquares, TensionsMinimiseTheScaledWrench) {
  for (const auto& [robot, pose, label] : derivative_cases(6)) {
    SCOPED_TRACE(label);
    const PlatformState state = platform_state(robot, pose);
    const TensionModel model = tensions_least_squares(robot, state);
    ASSERT_TRUE(model.valid);
    const double metre = characteristic_length_m(robot);
    Vector6 residual = wrench_residual(robot, state, model.tension_N);
    if (robot.cable_count() == 6) {
      EXPECT_LE(residual.norm(), 1e-9 * model.tension_N.norm());
    } else {
      EXPECT_GT(residual.norm(), 1e-3);  // a random pose is no equilibrium
    }
    residual.tail<3>() /= metre * metre;  // ΞᵀS² (…) : the gradient of the squared wrench
    EXPECT_LE((structure_matrix(state).transpose() * residual).norm(),
              1e-10 * model.tension_N.norm());
  }
}

TEST(LeastSquares, DerivativeByTwistWithANonZeroResidual) {
  for (const auto& [robot, pose, label] : derivative_cases(6)) {
    SCOPED_TRACE(label);
    const TensionModel model = tensions_least_squares(robot, platform_state(robot, pose));
    ASSERT_TRUE(model.valid);
    const auto numeric = numeric_pose_jacobian(
        [&](const Pose& p) {
          return tensions_least_squares(robot, platform_state(robot, p)).tension_N;
        },
        pose, 1e-2 / conditioning(model));
    EXPECT_TRUE(jacobian_matches(model.by_twist, numeric, 1e-7));
  }
}

TEST(LeastSquares, UndefinedForRedundantOrCoincidentCables) {
  test::Rng rng(52);
  const Robot seven = test::random_robot(rng, 7);
  EXPECT_FALSE(
      tensions_least_squares(seven, platform_state(seven, test::random_pose(rng, seven))).valid);
  Robot twin = test::random_robot(rng, 2);
  twin.cables[1] = twin.cables[0];
  EXPECT_FALSE(
      tensions_least_squares(twin, platform_state(twin, test::random_pose(rng, twin))).valid);
}

TEST(Tension, AreDefinedAsLongAsMoreThanRoundingTellsTwoCablesApart) {
  test::Rng rng(53);
  const Robot robot = test::random_robot(rng, 2);
  const Pose pose = test::random_pose(rng, robot);
  const auto with_twins = [&](double apart_m) {
    Robot twin = robot;
    twin.cables[1] = twin.cables[0];
    twin.cables[1].pulley.position_m.z() += apart_m;
    const PlatformState state = platform_state(twin, pose);
    const bool by_rows = tensions_left_inverse(twin, state, left_inverse_rows(2)).valid;
    EXPECT_EQ(tensions_least_squares(twin, state).valid, by_rows) << apart_m;
    return by_rows;
  };
  EXPECT_TRUE(with_twins(1e-6));
  EXPECT_TRUE(with_twins(1e-10));
  EXPECT_FALSE(with_twins(2e-14));
  EXPECT_FALSE(with_twins(0.0));
}

TEST(Tension, NoCableTangentNoTensionsAndNoStiffness) {
  const Robot robot = load_robot("irma4");
  const Cable& first = robot.cables[0];
  const Pose inside{
      first.pulley.position_m + 0.03 * first.pulley.x_axis() - first.platform_anchor_m,
      Eigen::Quaterniond::Identity()};
  const PlatformState state = platform_state(robot, inside);
  ASSERT_FALSE(state.valid);
  EXPECT_FALSE(tensions_left_inverse(robot, state, left_inverse_rows(4)).valid);
  EXPECT_FALSE(tensions_least_squares(robot, state).valid);
  const CableVector tension = CableVector::Constant(4, 50.0);
  EXPECT_FALSE(wrench_residual(robot, state, tension).allFinite());
  EXPECT_FALSE(stiffness(robot, state, tension).allFinite());
  const Eigen::MatrixXd free = free_motion_stiffness(robot, state, tension);
  EXPECT_EQ(free.rows(), 2);
  EXPECT_TRUE(free.array().isNaN().all());
}

TEST(Tension, NowhereIsNoPlaceForAnyNumberOfCables) {
  test::Rng rng(55);
  const Pose nowhere{Vector3::Constant(kNaN), Eigen::Quaterniond::Identity()};
  for (int n = 1; n <= 8; ++n) {
    const PlatformState state = platform_state(test::random_robot(rng, n), nowhere);
    ASSERT_FALSE(state.valid);
    const Eigen::MatrixXd basis = free_motion_basis(state);
    EXPECT_EQ(basis.rows(), 6);
    EXPECT_EQ(basis.cols(), n < 6 ? 6 - n : 0);
    EXPECT_TRUE(basis.array().isNaN().all());
  }
}

TEST(CharacteristicLength, IsTheRmsAnchorDistanceFromTheCentreOfMass) {
  const Robot robot = load_robot("irma4");
  EXPECT_NEAR(characteristic_length_m(robot), std::sqrt(2 * 0.075 * 0.075 + 0.093 * 0.093), 1e-15);
  Robot point = robot;
  for (Cable& cable : point.cables) cable.platform_anchor_m = point.platform.centre_of_mass_m;
  EXPECT_EQ(characteristic_length_m(point), 1.0);
}

}  // namespace
}  // namespace cdprcal
