// Robots whose platform keeps to a plane, or does not turn: from readings to the initial pose.
#include <gtest/gtest.h>

#include "../support/numeric_jacobian.hpp"
#include "cdprcal/calibration/initial_guess.hpp"
#include "cdprcal/calibration/multi_start.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/estimation/assembly.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/statics/wrench.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal::test {
namespace {

/// What a plane that is across no axis of the world is turned by from the upright one.
Matrix3 tilt() {
  return (Eigen::AngleAxisd(0.5, Vector3::UnitX()) * Eigen::AngleAxisd(0.4, Vector3::UnitZ()))
      .toRotationMatrix();
}

/// Four eyelets at the corners of an upright frame, x along it; or of one that is turned.
Robot frame(Motion motion, const Matrix3& turn) {
  Robot robot;
  robot.name = "frame";
  robot.platform.mass_kg = 3.0;
  robot.platform.centre_of_mass_m = {0.01, 0.0, -0.03};
  robot.platform.motion = motion;
  if (row_of(motion).is_planar()) robot.platform.motion_plane_normal = Vector3::UnitY();
  const double half = row_of(motion).is_point() ? 0.0 : 0.08;
  const double depth = row_of(motion).is_planar() ? 0.0 : 0.7;
  for (const auto& [x, y, z] : std::vector<std::array<double, 3>>{
           {-1.4, -depth, 0.1}, {1.5, depth, -0.1}, {1.4, -depth, 1.9}, {-1.5, depth, 2.0}}) {
    Cable cable;
    cable.pulley.position_m = {x, y, z};
    cable.pulley.axes_world.col(0) = Vector3::UnitX();
    cable.pulley.axes_world.col(2) = Vector3::UnitY();
    cable.pulley.axes_world.col(1) = Vector3::UnitY().cross(Vector3::UnitX());
    cable.platform_anchor_m = {half * (x > 0 ? 1 : -1), 0.0, half * (z > 1 ? 1 : -1)};
    cable.pulley.position_m = turn * cable.pulley.position_m;
    cable.pulley.axes_world = turn * cable.pulley.axes_world;
    cable.platform_anchor_m = turn * cable.platform_anchor_m;
    robot.cables.push_back(cable);
  }
  robot.platform.centre_of_mass_m = turn * robot.platform.centre_of_mass_m;
  robot.platform.motion_plane_normal = turn * robot.platform.motion_plane_normal;
  robot.tension_min_N = 1.0;
  robot.tension_max_N = 500.0;
  robot.sigma.length_m = 1e-3;
  robot.sigma.tension_N = 0.2;
  finalise(robot);
  return robot;
}

/// Tensions of at least 20 N that the platform is in balance with, guides carrying the rest.
CableVector balancing(const Robot& robot, const Pose& pose) {
  const PlatformState state = platform_state(robot, pose);
  const TwistBasis free = motion_basis(robot);
  const Eigen::MatrixXd a = free.transpose() * structure_matrix(state);
  const Eigen::VectorXd load = free.transpose() * gravity_wrench(robot, state);
  const CableVector pretension = CableVector::Constant(robot.cable_count(), 60.0);
  return pretension + least_norm(a, Eigen::VectorXd(load - a * pretension));
}

struct Rests {
  CalibrationProblem problem;
  std::vector<Pose> truth;
};

Rests rests(Motion motion, bool whole_lengths, double noise,
            const Matrix3& turn = Matrix3::Identity()) {
  Rests out;
  out.problem.robot = frame(motion, turn);
  const Robot& robot = out.problem.robot;
  RandomNormal random(7);
  const ReadingOffsets offsets = random_offsets(4, random);
  const TwistBasis free = motion_basis(robot);
  for (int i = 0; i < 16; ++i) {
    Eigen::VectorXd step(free.cols());
    for (double& s : step) s = 0.2 * random();
    const Pose pose =
        plus(on_motion(robot, {turn * Vector3(0.1, 0.0, 1.0), Eigen::Quaterniond::Identity()}),
             free * step);
    out.truth.push_back(pose);
    Measurement m =
        synthetic_measurement(robot, pose, balancing(robot, pose), PoseKind::static_pose, offsets,
                              reading_noise(robot.sigma, noise, whole_lengths), random);
    m.swivel_rad.setConstant(kNaN);
    m.roll_pitch_yaw_rad.setConstant(kNaN);
    m.absolute_yaw_rad = kNaN;
    m.position_m.setConstant(kNaN);
    out.problem.measurements.push_back(m);
  }
  return out;
}

class Guided : public ::testing::TestWithParam<std::tuple<Motion, bool>> {
 protected:
  static Rests rests(bool whole_lengths, double noise) {
    const auto [motion, tilted] = GetParam();
    return test::rests(motion, whole_lengths, noise, tilted ? tilt() : Matrix3::Identity());
  }
};

TEST_P(Guided, LengthsAndTensionsFindThePoseAndNoOtherFreedom) {
  const Rests r = rests(false, 0.0);
  const CalibrationResult result = solve_from_starts(r.problem, std::nullopt, 12, {});
  ASSERT_EQ(result.status, CalibrationStatus::converged) << result.reason;
  for (std::size_t i = 0; i < r.truth.size(); ++i) {
    EXPECT_LT(minus(result.poses[i], r.truth[i]).norm(), 1e-6) << i;
    EXPECT_LT(minus(on_motion(r.problem.robot, result.poses[i]), result.poses[i]).norm(), 1e-9);
  }
  const TwistBasis held = guided_basis(r.problem.robot), free = motion_basis(r.problem.robot);
  EXPECT_LT((*result.covariance * held).norm(), 1e-12);
  const Eigen::MatrixXd own = free.transpose() * *result.covariance * free;
  EXPECT_GT(SymmetricEigen<Eigen::MatrixXd>(own).eigenvalues()[0], 0.0);
}

TEST_P(Guided, WholeLengthsAloneDo) {
  Rests r = rests(true, 0.0);
  for (Measurement& m : r.problem.measurements) {
    m.length_m.setConstant(kNaN);
    m.tension_N.setConstant(kNaN);
    m.kind = PoseKind::kinematic_pose;
  }
  const CalibrationResult result = solve_from_starts(r.problem, std::nullopt, 12, {});
  ASSERT_EQ(result.status, CalibrationStatus::converged) << result.reason;
  EXPECT_LT(minus(result.poses[0], r.truth[0]).norm(), 1e-6);
}

TEST_P(Guided, ErrorsAreWithinTheirCovariance) {
  double squares = 0.0, count = 0.0;
  Rests r = rests(false, 0.0);
  const TwistBasis free = motion_basis(r.problem.robot);
  RandomNormal random(11);
  for (int trial = 0; trial < 40; ++trial) {
    CalibrationProblem noisy = r.problem;
    for (Measurement& m : noisy.measurements) {
      for (double& l : m.length_m) l += noisy.robot.sigma.length_m * random();
      for (double& t : m.tension_N) t += noisy.robot.sigma.tension_N * random();
    }
    const CalibrationResult result = solve(noisy, r.truth);
    ASSERT_EQ(result.status, CalibrationStatus::converged) << result.reason;
    const Eigen::VectorXd error = free.transpose() * minus(result.poses[0], r.truth[0]);
    const Eigen::MatrixXd own = free.transpose() * *result.covariance * free;
    squares += error.dot(solve_symmetric(own, error));
    count += static_cast<double>(free.cols());
  }
  // χ² of that many degrees of freedom: ± 4 standard deviations.
  EXPECT_NEAR(squares, count, 4.0 * std::sqrt(2.0 * count));
}

TEST_P(Guided, DerivativesAreAlongItsFreedomsAlone) {
  const Rests r = rests(true, 1.0);
  Assembly assembly(r.problem, r.truth);
  assembly.poses().update_wrench_whitening(1.0);
  Eigen::VectorXd residuals;
  Eigen::MatrixXd jacobian;
  assembly.linearise(residuals, jacobian);
  const TwistBasis free = motion_basis(r.problem.robot), held = guided_basis(r.problem.robot);
  for (std::size_t i = 1; i < r.truth.size(); ++i) {
    const Eigen::MatrixXd own = jacobian.middleCols(6 * static_cast<Eigen::Index>(i), 6);
    EXPECT_LT((own * held).norm(), 1e-9 * own.norm());
    // The gradient of the cost, the tensions of guides being what fits best.
    const Eigen::VectorXd gradient = (own * free).transpose() * residuals;
    for (Eigen::Index k = 0; k < free.cols(); ++k) {
      const auto cost = [&](double step) {
        std::vector<Pose> poses = r.truth;
        poses[i] = plus(poses[i], step * free.col(k));
        Assembly moved(r.problem, poses);
        moved.poses().update_wrench_whitening(1.0);
        return moved.cost();
      };
      const double slope = (cost(1e-6) - cost(-1e-6)) / 2e-6;
      // Whitening that moves with the pose is left out, as everywhere.
      EXPECT_NEAR(gradient[k], slope, 0.05 * (1.0 + std::abs(slope)) + 0.02 * gradient.norm());
    }
  }
}

/// Guided poses far from one another, by changes of length: none is turned over on the way.
TEST(GuidedGuesses, NoPoseIsTurnedOver) {
  RandomNormal random(3);
  for (const Matrix3& turn : {Matrix3(Matrix3::Identity()), tilt()}) {
    Robot robot = frame(Motion::r1t2, turn);
    for (Cable& cable : robot.cables) {  // crossed, as they often are, to hold the turn
      const Vector3 across = turn * Vector3::UnitX();
      cable.platform_anchor_m -= 2.0 * across.dot(cable.platform_anchor_m) * across;
    }
    const TwistBasis free = motion_basis(robot);
    std::vector<Pose> truth;
    std::vector<Measurement> measurements;
    for (int i = 0; i < 60; ++i) {
      const Pose middle =
          on_motion(robot, {turn * Vector3(0.0, 0.0, 1.0), Eigen::Quaterniond::Identity()});
      const Eigen::Vector3d step(0.45 * random(), 0.3 * random(), 0.15 * random());
      const Pose pose = plus(middle, free * step);
      if (!platform_state(robot, pose).valid) continue;
      Measurement m;
      m.length_m = platform_state(robot, pose).length_m();
      m.swivel_rad = m.tension_N = CableVector::Constant(4, kNaN);
      m.kind = PoseKind::kinematic_pose;
      truth.push_back(pose);
      measurements.push_back(m);
    }
    const std::vector<Pose> guesses = measurement_guesses(robot, measurements, truth.front(), {});
    for (std::size_t i = 0; i < truth.size(); ++i) {
      EXPECT_LT(minus(guesses[i], truth[i]).norm(), 1e-6) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Motions, Guided,
                         ::testing::Combine(::testing::Values(Motion::t3, Motion::r1t2, Motion::t2),
                                            ::testing::Bool()),
                         [](const auto& info) {
                           return std::string("m") + to_string(std::get<0>(info.param)) +
                                  (std::get<1>(info.param) ? "Tilted" : "");
                         });

}  // namespace
}  // namespace cdprcal::test
