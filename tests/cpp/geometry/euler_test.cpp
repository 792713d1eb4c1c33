#include "cdprcal/geometry/euler.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "../support/numeric_jacobian.hpp"
#include "../support/random_robot.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

using test::jacobian_matches;
using test::random_rotation;
using test::Rng;
using test::uniform;

class Euler : public ::testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] EulerConvention convention() const { return parse_euler_convention(GetParam()); }
  /// Which angle the convention's letter at `place` is: 0 roll, 1 pitch, 2 yaw.
  [[nodiscard]] static int angle_at(int place) { return GetParam()[place] - 'X'; }

  /// Angles with the middle one at most `largest` from 0.
  static Vector3 random_angles(Rng& rng, double largest = 1.5) {
    Vector3 angles = test::uniform_vector(rng, Vector3::Constant(-3.1), Vector3::Constant(3.1));
    angles[angle_at(1)] = uniform(rng, -largest, largest);
    return angles;
  }
};

INSTANTIATE_TEST_SUITE_P(AllOrders, Euler,
                         ::testing::Values("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"),
                         [](const auto& suite) { return std::string(suite.param); });

TEST_P(Euler, NameGivesTheOrderOfTheFactors) {
  Rng rng(11);
  const Vector3 angles = random_angles(rng);
  Matrix3 product = Matrix3::Identity();
  for (int place = 0; place < 3; ++place) {
    const int axis = angle_at(place);
    product *= Eigen::AngleAxisd(angles[axis], Vector3::Unit(axis)).toRotationMatrix();
  }
  EXPECT_LE((rotation_from_euler(angles, convention()).toRotationMatrix() - product).norm(), 1e-15);
  EXPECT_EQ(to_string(convention()), GetParam());
}

TEST_P(Euler, AnglesGoRoundThroughTheRotation) {
  Rng rng(12);
  for (int i = 0; i < 300; ++i) {
    const Vector3 angles = random_angles(rng);
    const Vector3 back = euler_from_rotation(
        rotation_from_euler(angles, convention()).toRotationMatrix(), convention());
    for (int a = 0; a < 3; ++a) EXPECT_NEAR(wrap_angle(back[a] - angles[a]), 0.0, 1e-13);
  }
}

TEST_P(Euler, RotationsGoRoundThroughTheAngles) {
  Rng rng(13);
  for (int i = 0; i < 300; ++i) {
    const Matrix3 rotation = random_rotation(rng).toRotationMatrix();
    const Vector3 angles = euler_from_rotation(rotation, convention());
    EXPECT_LE(std::abs(angles[angle_at(1)]), kPi / 2);
    EXPECT_LE((rotation_from_euler(angles, convention()).toRotationMatrix() - rotation).norm(),
              1e-14);
  }
}

TEST_P(Euler, RotationsGoRoundCloseToGimbalLock) {
  Rng rng(14);
  for (const double distance : {1e-2, 1e-5, 1e-8, 1e-10, 1e-13, 0.0}) {
    for (const double sign : {-1.0, 1.0}) {
      Vector3 angles = random_angles(rng);
      angles[angle_at(1)] = sign * (kPi / 2 - distance);
      const Matrix3 rotation = rotation_from_euler(angles, convention()).toRotationMatrix();
      const Vector3 back = euler_from_rotation(rotation, convention());
      EXPECT_LE((rotation_from_euler(back, convention()).toRotationMatrix() - rotation).norm(),
                2e-12)
          << distance;
    }
  }
}

TEST_P(Euler, AtGimbalLockTheLastAngleIsZero) {
  // Integers: the only rotations that are at gimbal lock exactly in floating point.
  const int a = angle_at(0), b = angle_at(1), c = angle_at(2);
  Matrix3 quarter = Matrix3::Zero();
  quarter.col(b) = Vector3::Unit(b);
  quarter.col(a) = Vector3::Unit(c);
  quarter.col(c) = Vector3::Unit(a);
  quarter.col(a) *= quarter.determinant();
  ASSERT_EQ(quarter.determinant(), 1.0);
  const Vector3 angles = euler_from_rotation(quarter, convention());
  EXPECT_EQ(angles[c], 0.0);
  EXPECT_EQ(std::abs(angles[b]), kPi / 2);
  EXPECT_LE((rotation_from_euler(angles, convention()).toRotationMatrix() - quarter).norm(), 1e-15);
}

TEST_P(Euler, RateMatrixMapsRatesToAngularVelocity) {
  Rng rng(15);
  for (int i = 0; i < 20; ++i) {
    const Vector3 angles = i == 0   ? Vector3::Zero()
                           : i == 1 ? Vector3::Constant(1e-9)
                                    : random_angles(rng);
    const Eigen::Quaterniond here = rotation_from_euler(angles, convention());
    const auto numeric = test::numeric_jacobian(
        [&](const Eigen::VectorXd& x) {
          return log_so3(rotation_from_euler(x, convention()) * here.conjugate());
        },
        angles);
    EXPECT_TRUE(jacobian_matches(euler_rate_matrix(angles, convention()), numeric, 1e-10));
  }
}

TEST_P(Euler, InverseRateMatrixIsTheDerivativeOfTheAngles) {
  Rng rng(16);
  for (int i = 0; i < 20; ++i) {
    const Vector3 angles = i == 0 ? Vector3::Zero() : random_angles(rng, 1.2);
    const Pose pose{Vector3::Zero(), rotation_from_euler(angles, convention())};
    const auto numeric = test::numeric_pose_jacobian(
        [&](const Pose& p) {
          const Vector3 moved = euler_from_rotation(p.rotation_matrix(), convention());
          return Vector3((moved - angles).unaryExpr(&wrap_angle));
        },
        pose);
    Eigen::Matrix<double, 3, 6> expected;
    expected << Matrix3::Zero(), euler_rate_matrix(angles, convention()).inverse();
    EXPECT_TRUE(jacobian_matches(expected, numeric, 1e-9));
  }
}

TEST_P(Euler, ColumnDerivatives) {
  Rng rng(17);
  for (int i = 0; i < 20; ++i) {
    const Vector3 angles = i == 0   ? Vector3::Zero()
                           : i == 1 ? Vector3::Constant(1e-9)
                                    : random_angles(rng, 1.2);
    const Pose pose{Vector3::Zero(), rotation_from_euler(angles, convention())};
    const EulerRateDerivative analytic = euler_rate_derivative(angles, convention());
    EXPECT_EQ(analytic.rate_matrix, euler_rate_matrix(angles, convention()));
    for (int column = 0; column < 3; ++column) {
      const auto numeric = test::numeric_pose_jacobian(
          [&](const Pose& p) {
            const Vector3 moved = euler_from_rotation(p.rotation_matrix(), convention());
            return Vector3(euler_rate_matrix(moved, convention()).col(column));
          },
          pose);
      Eigen::Matrix<double, 3, 6> expected;
      expected << Matrix3::Zero(), analytic.column_derivative[column];
      EXPECT_TRUE(jacobian_matches(expected, numeric, 1e-9)) << "column " << column;
    }
  }
}

TEST(EulerNames, UnknownOrdersAreRefusedByName) {
  for (const char* name : {"xyz", "", "XYX", "XY", "ZYXZ"}) {
    try {
      parse_euler_convention(name);
      ADD_FAILURE() << name;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("ZYX"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace cdprcal
