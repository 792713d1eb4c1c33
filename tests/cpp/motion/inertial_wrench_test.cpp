// What it takes to accelerate the platform, against momentum and numeric derivatives.
#include "cdprcal/motion/inertial_wrench.hpp"

#include "../support/numeric_jacobian.hpp"
#include "../support/random_robot.hpp"
#include "cdprcal/effects/effect.hpp"
#include "cdprcal/motion/known_motion.hpp"

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

TEST(KnownMotion, DampingTakesTheEnergyThatItsDecaysSay) {
  Rng rng(3);
  for (int i = 0; i < 20; ++i) {
    const Moving moving = random_motion(rng);
    const auto unit = damping_wrench(moving.robot, moving.platform(), moving.state.twist);
    const Vector2 power = unit.transpose() * moving.state.twist;
    const Matrix3 r = moving.state.pose.rotation_matrix();
    const Vector3 rate = moving.state.twist.tail<3>();
    const Vector3 velocity = moving.state.twist.head<3>() +
                             rate.cross(Vector3(r * moving.robot.platform.centre_of_mass_m));
    EXPECT_NEAR(power[0], 2.0 * moving.robot.platform.mass_kg * velocity.squaredNorm(), 1e-9);
    EXPECT_NEAR(power[1],
                2.0 * rate.dot(r * moving.robot.platform.inertia_kg_m2 * r.transpose() * rate),
                1e-9);
  }
}

TEST(KnownMotion, CountsAtItsMomentsOnly) {
  Rng rng(4);
  const Moving moving = random_motion(rng);
  const auto effect =
      known_motion({{7.0}, {3.5, moving.state.twist, moving.state.acceleration}}, {0.4, 0.2});
  EXPECT_EQ(effect->size(4), 0);
  const auto added_at = [&](const Pose& pose, double time_s) {
    Measurement m;
    m.time_s = time_s;
    const PlatformState state = platform_state(moving.robot, pose);
    PoseEvaluation evaluation;
    evaluation.wrench.setZero();
    evaluation.wrench_by_twist.setZero();
    effect->add_to_readings({moving.robot, state, pose, m}, {}, evaluation);
    return evaluation;
  };
  const Pose& pose = moving.state.pose;
  EXPECT_EQ(added_at(pose, 3.4).wrench, Vector6::Zero());
  EXPECT_EQ(added_at(pose, 7.0).wrench, Vector6::Zero());  // at rest then
  const Vector6 expected =
      inertial_wrench(moving.robot, moving.platform(), moving.state.twist,
                      moving.state.acceleration)
          .wrench +
      damping_wrench(moving.robot, moving.platform(), moving.state.twist) * Vector2(0.4, 0.2);
  EXPECT_LT((added_at(pose, 3.5).wrench - expected).norm(), 1e-12 * expected.norm());
}

TEST(KnownMotion, HasTheseDerivatives) {
  Rng rng(5);
  for (int i = 0; i < 10; ++i) {
    const Moving moving = random_motion(rng);
    const auto effect =
        known_motion({{1.0, moving.state.twist, moving.state.acceleration}}, {0.7, 0.3});
    const auto evaluated = [&](const Pose& pose) {
      Measurement m;
      m.time_s = 1.0;
      PoseEvaluation out;
      out.wrench.setZero();
      out.wrench_by_twist.setZero();
      effect->add_to_readings({moving.robot, platform_state(moving.robot, pose), pose, m}, {}, out);
      return out;
    };
    const NumericJacobian numeric = numeric_pose_jacobian(
        [&](const Pose& pose) -> Eigen::VectorXd { return evaluated(pose).wrench; },
        moving.state.pose);
    EXPECT_TRUE(jacobian_matches(evaluated(moving.state.pose).wrench_by_twist, numeric));
  }
}

}  // namespace
}  // namespace cdprcal::test
