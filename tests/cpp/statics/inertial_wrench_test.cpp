// What it takes to accelerate the platform, against momentum and numeric derivatives.
#include "cdprcal/statics/inertial_wrench.hpp"

#include "../support/numeric_jacobian.hpp"
#include "../support/random_robot.hpp"
#include "cdprcal/effects/effect.hpp"
#include "cdprcal/motion/damping.hpp"
#include "cdprcal/motion/motion_state.hpp"

namespace cdprcal::test {
namespace {

using Vector2 = Eigen::Vector2d;

struct Moving {
  Robot robot;
  MotionState state;
  [[nodiscard]] PlatformState platform() const { return platform_state(robot, state.pose); }
};

Moving random_motion(Rng& rng) {
  Moving out{random_robot(rng, 4), {}};
  out.state.pose = random_pose(rng, out.robot, random_rotation(rng));
  const auto vector = [&](double size) {
    return uniform_vector(rng, Vector3::Constant(-size), Vector3::Constant(size));
  };
  out.state.twist << vector(1.0), vector(2.0);
  out.state.acceleration << vector(5.0), vector(20.0);
  return out;
}

/// (momentum, angular momentum about the world's origin) of a platform.
Vector6 momentum(const Robot& robot, const MotionState& state) {
  const Platform& platform = robot.platform;
  const Matrix3 r = state.pose.rotation_matrix();
  const Vector3 centre = state.pose.position_m + r * platform.centre_of_mass_m;
  const Vector3 rate = state.twist.tail<3>();
  const Vector3 velocity =
      state.twist.head<3>() + rate.cross(Vector3(r * platform.centre_of_mass_m));
  Vector6 out;
  out << platform.mass_kg * velocity,
      r * platform.inertia_kg_m2 * r.transpose() * rate + platform.mass_kg * centre.cross(velocity);
  return out;
}

TEST(InertialWrench, IsTheRateOfMomentum) {
  Rng rng(1);
  for (int i = 0; i < 20; ++i) {
    const Moving moving = random_motion(rng);
    const auto [rate, error] = extrapolate(
        [&](double h) -> Eigen::VectorXd {
          return (momentum(moving.robot, moved(moving.state, h)) -
                  momentum(moving.robot, moved(moving.state, -h))) /
                 (2.0 * h);
        },
        1e-2);
    const Vector6 wrench = inertial_wrench(moving.robot, moving.platform(), moving.state.twist,
                                           moving.state.acceleration)
                               .wrench;
    Vector6 about_origin = wrench;  // from P
    about_origin.tail<3>() += moving.state.pose.position_m.cross(Vector3(wrench.head<3>()));
    EXPECT_LT((about_origin - rate).norm(), 1e-6 * rate.norm()) << error.transpose();
  }
}

TEST(InertialWrench, HasTheseDerivatives) {
  Rng rng(2);
  for (int i = 0; i < 20; ++i) {
    const Moving moving = random_motion(rng);
    const auto wrench_at = [&](const MotionState& state) -> Eigen::VectorXd {
      return inertial_wrench(moving.robot, platform_state(moving.robot, state.pose), state.twist,
                             state.acceleration)
          .wrench;
    };
    const NumericJacobian numeric = numeric_tangent_jacobian(
        [&](const Eigen::VectorXd& delta) { return wrench_at(plus(moving.state, delta)); },
        kMotionUnknowns);
    const InertialWrench at = inertial_wrench(moving.robot, moving.platform(), moving.state.twist,
                                              moving.state.acceleration);
    Eigen::Matrix<double, 6, kMotionUnknowns> analytic;
    analytic << Eigen::Matrix<double, 6, 3>::Zero(), at.by_rotation,
        Eigen::Matrix<double, 6, 3>::Zero(), at.by_angular_velocity, at.mass;
    EXPECT_TRUE(jacobian_matches(analytic, numeric));
  }
}

TEST(InertialWrench, IsTheMassTimesWhatItsCentreIsAcceleratedBy) {
  Rng rng(4);
  for (int i = 0; i < 20; ++i) {
    const Moving moving = random_motion(rng);
    const PlatformState platform = moving.platform();
    const InertialWrench at =
        inertial_wrench(moving.robot, platform, moving.state.twist, moving.state.acceleration);
    const Vector3 force_N = moving.robot.platform.mass_kg *
                            centre_acceleration_m_s2(platform.centre_of_mass_arm_m,
                                                     moving.state.twist, moving.state.acceleration);
    EXPECT_LT((at.wrench.head<3>() - force_N).norm(), 1e-12 * force_N.norm());
  }
}

/// A measurement in motion, and what the balance gains by it.
PoseEvaluation balanced(const Moving& moving, const Pose& pose, const ActiveEffects& effects) {
  Measurement m;
  m.tension_N = CableVector::Zero(moving.robot.cable_count());
  m.twist = moving.state.twist;
  m.acceleration = moving.state.acceleration;
  PoseEvaluation out;
  evaluate_pose(moving.robot, m, pose, StaticsModel::wrench, {}, effects, true, out);
  return out;
}

TEST(Damping, TakesTheEnergyThatItsDecaysSay) {
  Rng rng(3);
  for (int i = 0; i < 20; ++i) {
    const Moving moving = random_motion(rng);
    Measurement m;
    m.twist = moving.state.twist;
    const PlatformState platform = moving.platform();
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(ReadingRows{4}.size(), 2);
    damping()->columns({moving.robot, platform, moving.state.pose, m}, {}, columns);
    const Vector2 power = columns.middleRows<6>(ReadingRows{4}.wrench()).transpose() * m.twist;
    const Matrix3 r = moving.state.pose.rotation_matrix();
    const Vector3 rate = m.twist.tail<3>();
    const Vector3 velocity =
        m.twist.head<3>() + rate.cross(Vector3(r * moving.robot.platform.centre_of_mass_m));
    EXPECT_NEAR(power[0], 2.0 * moving.robot.platform.mass_kg * velocity.squaredNorm(), 1e-9);
    EXPECT_NEAR(power[1],
                2.0 * rate.dot(r * moving.robot.platform.inertia_kg_m2 * r.transpose() * rate),
                1e-9);
  }
}

TEST(InertialWrench, IsPartOfTheBalanceWithItsDerivatives) {
  Rng rng(5);
  const Vector2 by_s(0.7, 0.3);
  const ActiveEffects damped{{damping(), by_s}};
  for (int i = 0; i < 10; ++i) {
    const Moving moving = random_motion(rng);
    const Pose& pose = moving.state.pose;
    const PlatformState platform = moving.platform();
    Measurement m;
    m.twist = moving.state.twist;
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(ReadingRows{4}.size(), 2);
    damping()->columns({moving.robot, platform, pose, m}, {}, columns);
    const Vector6 expected =
        inertial_wrench(moving.robot, platform, moving.state.twist, moving.state.acceleration)
            .wrench +
        columns.middleRows<6>(ReadingRows{4}.wrench()) * by_s -
        gravity_wrench(moving.robot, platform);
    const PoseEvaluation at = balanced(moving, pose, damped);
    EXPECT_LT((at.wrench - expected).norm(), 1e-12 * expected.norm());
    const NumericJacobian numeric = numeric_pose_jacobian(
        [&](const Pose& moved) -> Eigen::VectorXd {
          return balanced(moving, moved, damped).wrench;
        },
        pose);
    EXPECT_TRUE(jacobian_matches(at.wrench_by_twist, numeric));
  }
}

}  // namespace
}  // namespace cdprcal::test
