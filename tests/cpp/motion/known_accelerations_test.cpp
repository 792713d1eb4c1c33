// What effects may multiply of a noisy acceleration.
#include "cdprcal/motion/known_accelerations.hpp"

#include <gtest/gtest.h>

#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/statics/inertial_wrench.hpp"
#include "support/random_robot.hpp"

namespace cdprcal::test {
namespace {

struct Moments {
  Robot robot = load_robot("irma4");
  std::vector<Pose> poses;
  std::vector<Matrix6> noise;
  std::vector<Measurement> moments;
  Matrix6 mass;

  /// Of a platform that swings along `swing`, with white noise of unit variance in what its motion
  /// takes.
  explicit Moments(const Vector6& swing, int count = 400) {
    const Pose pose{Vector3(0.0, 0.0, 0.6), Eigen::Quaterniond::Identity()};
    mass = mass_matrix(robot, platform_state(robot, pose));
    Rng rng(2);
    std::normal_distribution<double> normal;
    for (int k = 0; k < count; ++k) {
      Vector6 taken = swing * std::sin(0.37 * k);
      for (double& one : taken) one += normal(rng);
      Measurement m;
      m.acceleration = mass.ldlt().solve(taken);
      m.inertial_sigma.setOnes();
      moments.push_back(m);
      poses.push_back(pose);
      noise.push_back(Matrix6::Identity());
    }
  }
  [[nodiscard]] Vector6 taken(std::size_t k) const { return mass * moments[k].acceleration; }
  void shrink() { shrink_accelerations(robot, poses, noise, 1.0, moments); }
};

TEST(ShrinkAccelerations, LeaveNothingOfNoise) {
  Moments of(Vector6::Zero());
  of.shrink();
  for (const Measurement& m : of.moments) {
    EXPECT_LT(m.acceleration.norm(), 1e-9);
    EXPECT_GT(m.inertial_sigma.minCoeff(), 0.3) << "what hides in the noise";
    EXPECT_LT(m.inertial_sigma.maxCoeff(), 1.0);
  }
}

TEST(ShrinkAccelerations, LeaveTheSwingAndTakeTheNoiseBesideIt) {
  Vector6 swing = Vector6::Zero();
  swing[0] = 3.0;
  Moments of(swing);
  const Moments before = of;
  of.shrink();
  double with_itself = 0.0, with_truth = 0.0, across = 0.0;
  for (std::size_t k = 0; k < of.moments.size(); ++k) {
    const Vector6 left = of.taken(k);
    const double truth = swing[0] * std::sin(0.37 * static_cast<double>(k));
    with_itself += left[0] * left[0];
    with_truth += left[0] * truth;
    across = std::max(across, left.tail<5>().norm());
    EXPECT_NEAR(of.moments[k].inertial_sigma[0], std::sqrt(1.0 - 1.0 / 5.5), 0.05);
  }
  EXPECT_NEAR(with_truth / with_itself, 1.0, 0.05) << "what it leads to expect is so";
  EXPECT_LT(across, 1.0) << "of five directions of noise, what lies along the swing's by chance";
  // With the noise in it, a sixth less would be expected.
  double noisy_itself = 0.0, noisy_truth = 0.0;
  for (std::size_t k = 0; k < of.moments.size(); ++k) {
    const double was = before.taken(k)[0];
    noisy_itself += was * was;
    noisy_truth += was * swing[0] * std::sin(0.37 * static_cast<double>(k));
  }
  EXPECT_NEAR(noisy_truth / noisy_itself, 4.5 / 5.5, 0.05);
}

TEST(ShrinkAccelerations, LeaveGuidedDirectionsAlone) {
  Moments of(Vector6::Constant(20.0));
  for (Matrix6& one : of.noise) one.row(5).setZero(), one.col(5).setZero();
  const Moments before = of;
  of.shrink();
  for (std::size_t k = 0; k < of.moments.size(); ++k) {
    EXPECT_NEAR(of.taken(k)[5], before.taken(k)[5], 1e-9);
  }
  std::vector<Measurement> none;
  shrink_accelerations(of.robot, {}, {}, 1.0, none);
}

}  // namespace
}  // namespace cdprcal::test
