// Seeded random robots and poses for tests: nothing about them is special, every cable is valid.
#pragma once

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/kinematics/platform.hpp"
#include "cdprcal/model/robot.hpp"

namespace cdprcal::test {

using Rng = std::mt19937_64;

inline double uniform(Rng& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}

inline Vector3 uniform_vector(Rng& rng, const Vector3& low, const Vector3& high) {
  return {uniform(rng, low.x(), high.x()), uniform(rng, low.y(), high.y()),
          uniform(rng, low.z(), high.z())};
}

/// Uniform over all orientations.
inline Eigen::Quaterniond random_rotation(Rng& rng) {
  std::normal_distribution<double> normal;
  const double w = normal(rng), x = normal(rng), y = normal(rng), z = normal(rng);
  return Eigen::Quaterniond(w, x, y, z).normalized();
}

/// A finalised robot of `cables` cables in a hall of about 4 × 4 × 3 m: anchors, swivel axes, mass,
/// centre of mass, inertia and Euler convention are random. Pulley radii are 1 to 8 cm, or all 0.
inline Robot random_robot(Rng& rng, int cables, bool zero_radius = false) {
  Robot robot;
  robot.name = "random" + std::to_string(cables);
  robot.gravity_m_s2 = uniform(rng, 9.7, 9.9);
  robot.platform.mass_kg = uniform(rng, 2.0, 40.0);
  robot.platform.centre_of_mass_m = uniform_vector(rng, {-0.1, -0.1, -0.15}, {0.1, 0.1, 0.15});
  const Vector3 sides = uniform_vector(rng, Vector3::Constant(0.2), Vector3::Constant(0.6));
  const Matrix3 axes = random_rotation(rng).toRotationMatrix();
  const Vector3 squares = sides.cwiseAbs2();
  const Vector3 moments = robot.platform.mass_kg / 12.0 *
                          (Vector3::Constant(squares.sum()) - squares);  // of a solid box
  robot.platform.inertia_kg_m2 = axes * moments.asDiagonal() * axes.transpose();
  for (int i = 0; i < cables; ++i) {
    Cable cable;
    cable.pulley.radius_m = zero_radius ? 0.0 : uniform(rng, 0.01, 0.08);
    cable.pulley.position_m = uniform_vector(rng, {-2.0, -2.0, 1.8}, {2.0, 2.0, 3.0});
    cable.pulley.axes_world = random_rotation(rng).toRotationMatrix();
    cable.platform_anchor_m = uniform_vector(rng, {-0.4, -0.4, 0.0}, {0.4, 0.4, 0.3});
    robot.cables.push_back(cable);
  }
  robot.tension_min_N = 0.05 * robot.weight_N();
  robot.tension_max_N = 5.0 * robot.weight_N();
  robot.euler_convention = static_cast<EulerConvention>(rng() % 6);
  finalise(robot);
  return robot;
}

/// Every cable has its tangent and is at least `margin_m` away from where it would lose it (swivel
/// axis, pulley), so that numeric derivatives may step around.
inline bool is_comfortable(const Robot& robot, const Pose& pose, double margin_m = 0.15) {
  const PlatformState state = platform_state(robot, pose);
  if (!state.valid) return false;
  for (int i = 0; i < state.cable_count; ++i) {
    if (state.cable[i].radial_distance_m < margin_m || state.cable[i].free_length_m < margin_m) {
      return false;
    }
  }
  return true;
}

/// A comfortable pose at the given orientation, position random in the hall.
inline Pose random_pose(Rng& rng, const Robot& robot, const Eigen::Quaterniond& rotation) {
  for (int attempt = 0; attempt < 10000; ++attempt) {
    const Pose pose{uniform_vector(rng, {-0.8, -0.8, 0.1}, {0.8, 0.8, 1.4}), rotation};
    if (is_comfortable(robot, pose)) return pose;
  }
  throw std::logic_error("no comfortable pose of the random robot");
}

/// A comfortable pose of any orientation.
inline Pose random_pose(Rng& rng, const Robot& robot) {
  return random_pose(rng, robot, random_rotation(rng));
}

inline CableVector random_tensions(Rng& rng, const Robot& robot) {
  CableVector tension(robot.cable_count());
  for (double& t : tension) t = uniform(rng, robot.tension_min_N, 2.0 * robot.weight_N());
  return tension;
}

/// One robot at one pose.
struct RobotPose {
  Robot robot;
  Pose pose;
  std::string label;  ///< for SCOPED_TRACE
};

/// What every derivative is checked on: 1 … max_cables cables, with pulleys and without, each at
/// the identity orientation, at rotations of 1e-9 and 1e-5 rad, and at three random orientations.
inline std::vector<RobotPose> derivative_cases(int max_cables = kMaxCables,
                                               std::uint64_t seed = 20251027) {
  Rng rng(seed);
  std::vector<RobotPose> cases;
  for (int n = 1; n <= max_cables; ++n) {
    for (const bool zero_radius : {false, true}) {
      const Robot robot = random_robot(rng, n, zero_radius);
      const auto add = [&](const Pose& pose, const std::string& rotation) {
        cases.push_back({robot, pose,
                         std::to_string(n) + " cables, " +
                             (zero_radius ? "eyelets, " : "pulleys, ") + rotation + " rotation"});
      };
      add(random_pose(rng, robot, Eigen::Quaterniond::Identity()), "identity");
      for (const double angle : {1e-9, 1e-5}) {
        const Vector3 axis = random_rotation(rng) * Vector3::UnitX();
        add(random_pose(rng, robot, exp_so3(angle * axis)), "tiny");
      }
      for (int i = 0; i < 3; ++i) add(random_pose(rng, robot), "random");
    }
  }
  return cases;
}

}  // namespace cdprcal::test
