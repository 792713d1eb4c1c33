#include "cdprcal/geometry/pose.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "../support/random_robot.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

using test::random_rotation;
using test::Rng;
using test::uniform_vector;

const std::vector<double> kAngles{0.0,    1e-300, 1e-12, 1e-8, 9.9e-7, 1.1e-6,
                                  9.9e-5, 1.1e-4, 1e-2,  0.5,  2.0,    3.1};

TEST(Rotation, ExpIsTheTurnAboutTheVectorByItsNorm) {
  Rng rng(1);
  for (const double angle : kAngles) {
    const Vector3 axis = random_rotation(rng) * Vector3::UnitX();
    const Matrix3 expected = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    EXPECT_LT((exp_so3(angle * axis).toRotationMatrix() - expected).cwiseAbs().maxCoeff(), 1e-15)
        << angle;
    EXPECT_NEAR(exp_so3(angle * axis).norm(), 1.0, 4e-16);
  }
}

TEST(Rotation, LogUndoesExpFromZeroToPi) {
  Rng rng(2);
  for (const double angle : kAngles) {
    for (int i = 0; i < 20; ++i) {
      const Vector3 v = angle * (random_rotation(rng) * Vector3::UnitX());
      EXPECT_LE((log_so3(exp_so3(v)) - v).norm(), 1e-15 * angle + 1e-15 * angle * angle * angle)
          << angle;
    }
  }
  for (const double below_pi : {1e-3, 1e-6, 1e-9, 1e-12}) {
    const Vector3 v = (kPi - below_pi) * (random_rotation(rng) * Vector3::UnitX());
    EXPECT_LE((log_so3(exp_so3(v)) - v).norm(), 1e-14) << below_pi;
  }
}

TEST(Rotation, LogIsAtMostPiAndKnowsBothSignsOfAQuaternion) {
  Rng rng(3);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Quaterniond q = random_rotation(rng);
    const Eigen::Quaterniond opposite(-q.w(), -q.x(), -q.y(), -q.z());
    EXPECT_LE(log_so3(q).norm(), kPi + 1e-15);
    EXPECT_LE((log_so3(q) - log_so3(opposite)).norm(), 1e-15);
    EXPECT_LE(exp_so3(log_so3(q)).angularDistance(q), 1e-14);
  }
  const Vector3 half_turn = log_so3(exp_so3({0.0, kPi, 0.0}));
  EXPECT_NEAR(std::abs(half_turn.y()), kPi, 1e-15);  // either sign is the same rotation
}

TEST(Pose, MinusUndoesPlusAndTheTwistIsInWorldAxes) {
  Rng rng(4);
  for (int i = 0; i < 100; ++i) {
    const Pose pose{uniform_vector(rng, -Vector3::Ones(), Vector3::Ones()), random_rotation(rng)};
    Vector6 twist;
    twist << uniform_vector(rng, -Vector3::Ones(), Vector3::Ones()),
        uniform_vector(rng, -Vector3::Ones(), Vector3::Ones());
    EXPECT_LE((minus(plus(pose, twist), pose) - twist).norm(), 1e-14);
    const Matrix3 turned = exp_so3(twist.tail<3>()).toRotationMatrix() * pose.rotation_matrix();
    EXPECT_LE((plus(pose, twist).rotation_matrix() - turned).norm(), 1e-14);
  }
}

TEST(Pose, GeodesicDistanceIsNotTheAngleDifferenceOfEquation20) {
  const Pose a{Vector3::Zero(), exp_so3({0.3, 0.0, 0.0})};
  const Pose b{Vector3::Zero(), exp_so3({0.0, 0.3, 0.0})};
  EXPECT_NEAR(rotation_angle_difference_rad(a, b), 0.0, 1e-15);
  // Half the turn between two perpendicular turns of 0.3 has the cosine cos²(0.15).
  const double half_cosine = std::cos(0.15) * std::cos(0.15);
  EXPECT_NEAR(rotation_distance_rad(a, b), 2.0 * std::acos(half_cosine), 1e-14);
  EXPECT_EQ(rotation_distance_rad(a, a), 0.0);
}

TEST(RotationFromMatrix, FindsTheNearestRotation) {
  Rng rng(5);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Quaterniond q = random_rotation(rng);
    EXPECT_LE(rotation_from_matrix(q.toRotationMatrix()).angularDistance(q), 1e-14);
    // A symmetric stretch moves the matrix away from SO(3) but not to another nearest rotation.
    const Matrix3 change = Matrix3::Random();
    const Matrix3 stretch = Matrix3::Identity() + 1e-7 * (change + change.transpose());
    const Eigen::Quaterniond found = rotation_from_matrix(q.toRotationMatrix() * stretch);
    EXPECT_LE(found.angularDistance(q), 1e-13);
  }
}

TEST(RotationFromMatrix, RefusesWhatIsNoRotation) {
  EXPECT_THROW(rotation_from_matrix(2.0 * Matrix3::Identity()), InputError);
  EXPECT_THROW(rotation_from_matrix(-Matrix3::Identity()), InputError);
  EXPECT_THROW(rotation_from_matrix(Matrix3::Zero()), InputError);
  Matrix3 nan = Matrix3::Identity();
  nan(0, 1) = kNaN;
  EXPECT_THROW(rotation_from_matrix(nan), InputError);
}

TEST(RotationBetween, TurnsOneDirectionIntoTheOtherTheShortWay) {
  Rng rng(6);
  for (int i = 0; i < 50; ++i) {
    const Vector3 from = 3.0 * (random_rotation(rng) * Vector3::UnitX());
    const Vector3 to = 0.1 * (random_rotation(rng) * Vector3::UnitX());
    const Eigen::Quaterniond found = rotation_between(from, to);
    EXPECT_LE((found * from.normalized() - to.normalized()).norm(), 1e-14);
    EXPECT_NEAR(log_so3(found).dot(from), 0.0, 1e-13);  // an axis across both
    const Eigen::Quaterniond back = rotation_between(from, -from);
    EXPECT_LE((back * from + from).norm(), 1e-13);
    const Vector3 nearly = -from + 1e-5 * Vector3::UnitY();
    EXPECT_LE((rotation_between(from, nearly) * from.normalized() - nearly.normalized()).norm(),
              1e-10);
  }
  EXPECT_EQ(rotation_between(Vector3::UnitZ(), Vector3::UnitZ())
                .angularDistance(Eigen::Quaterniond::Identity()),
            0.0);
}

TEST(WrapAngle, IsInTheHalfOpenTurn) {
  EXPECT_EQ(wrap_angle(kPi), kPi);
  EXPECT_EQ(wrap_angle(-kPi), kPi);
  EXPECT_NEAR(wrap_angle(3.0 * kPi + 0.1), -kPi + 0.1, 1e-14);
  EXPECT_NEAR(wrap_angle(-0.1 - 4.0 * kPi), -0.1, 1e-14);
}

}  // namespace
}  // namespace cdprcal
