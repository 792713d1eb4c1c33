// Equilibrium poses of irma4 and exact or noisy readings there, for the calibration tests.
#pragma once

#include <vector>

#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/estimation/problem.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal::test {

/// Tension sets of irma4 [N] whose equilibria spread over its workspace (paper Table II, rounded,
/// after a reference at 100 N each).
inline std::vector<CableVector> irma4_setpoints() {
  std::vector<CableVector> out;
  for (const auto& [a, b, c, d] : std::vector<std::array<double, 4>>{{100, 100, 100, 100},
                                                                     {118, 171, 116, 83},
                                                                     {83, 116, 171, 118},
                                                                     {115, 83, 119, 171},
                                                                     {171, 119, 83, 115},
                                                                     {81, 56, 31, 54},
                                                                     {54, 31, 56, 81},
                                                                     {31, 54, 81, 56},
                                                                     {56, 81, 54, 31}}) {
    CableVector t(4);
    t << a, b, c, d;
    out.push_back(t);
  }
  return out;
}

struct Scenario {
  CalibrationProblem problem;
  std::vector<Pose> truth;
};

/// Readings at the equilibria of `setpoints`; noise is `noise_scale` times the robot's σ.
inline Scenario scenario(const Robot& robot, const std::vector<CableVector>& setpoints,
                         PoseKind kind, double noise_scale, std::uint64_t seed) {
  Scenario out;
  out.problem.robot = robot;
  RandomNormal random(seed);
  const ReadingOffsets offsets = random_offsets(robot.cable_count(), random);
  for (const CableVector& tension : setpoints) {
    const EquilibriumResult rest = direct_from_tensions(robot, tension);
    if (rest.status != EquilibriumStatus::found) throw std::runtime_error(rest.reason);
    out.truth.push_back(rest.pose);
    out.problem.measurements.push_back(synthetic_measurement(
        robot, rest.pose, tension, kind, offsets, reading_noise(robot.sigma, noise_scale), random));
  }
  return out;
}

/// Every pose moved by up to `position_m` and turned by up to `angle_rad`, reproducibly.
inline std::vector<Pose> disturbed(const std::vector<Pose>& poses, double position_m,
                                   double angle_rad, std::uint64_t seed) {
  RandomNormal random(seed);
  std::vector<Pose> out;
  for (const Pose& pose : poses) {
    Vector3 shift(random(), random(), random()), turn(random(), random(), random());
    Vector6 twist;
    twist << position_m * shift.normalized(), angle_rad * turn.normalized();
    out.push_back(plus(pose, twist));
  }
  return out;
}

}  // namespace cdprcal::test
