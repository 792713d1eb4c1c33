// Robots and plans for the tests of the simulator and the start-up procedure.
#pragma once

#include <gtest/gtest.h>

#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/equilibria/inverse.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/simulator/simulate_startup.hpp"

namespace cdprcal::test {

/// The built-in examples of other numbers of cables; not like irma4 in any number.
inline Robot ring_robot(int cables) { return load_robot("ring" + std::to_string(cables)); }

/// With an accelerometer and a gyroscope away from P.
inline Robot with_inertial_unit(Robot robot) {
  robot.platform.inertial_unit_m.emplace(0.11, -0.07, 0.05);
  return robot;
}

/// τ₀ in the middle of a box and its eight corners, all stable at constant tensions.
inline StartUpPlan box_plan(const Robot& robot, const Vector3& lower_m, const Vector3& upper_m) {
  InverseOptions options;
  options.stability = StabilityNotion::constant_tensions;
  const auto at = [&](double x, double y, double z) {
    const InverseResult result = inverse(robot, {x, y, z}, options);
    if (result.status != EquilibriumStatus::found) throw std::runtime_error(result.reason);
    return result.tension_N;
  };
  StartUpPlan plan;
  const Vector3 m = 0.5 * (lower_m + upper_m);
  plan.setpoint_N.push_back(at(m.x(), m.y(), m.z()));
  for (const double z : {upper_m.z(), lower_m.z()}) {
    plan.setpoint_N.push_back(at(upper_m.x(), upper_m.y(), z));
    plan.setpoint_N.push_back(at(lower_m.x(), upper_m.y(), z));
    plan.setpoint_N.push_back(at(lower_m.x(), lower_m.y(), z));
    plan.setpoint_N.push_back(at(upper_m.x(), lower_m.y(), z));
  }
  return plan;
}

/// The paper's grid: eq. 19, two points an axis.
inline StartUpPlan irma4_plan() {
  return box_plan(load_robot("irma4"), {-0.4, -0.4, 0.6}, {0.4, 0.4, 1.2});
}

inline StartUpPlan ring_plan(const Robot& robot) {
  return box_plan(robot, {-0.17, -0.17, 0.65}, {0.17, 0.17, 0.95});
}

/// Sensors and drives without noise, quantisation, offsets.
inline SimulatorOptions perfect() {
  SimulatorOptions options;
  options.sensors = perfect_sensors();
  options.winch.tension_noise_N = 0.0;
  return options;
}

/// How far the true poses of each rest, on average, are from the equilibrium of its set-point.
struct RestError {
  double position_m = 0.0, rotation_rad = 0.0;
};
inline std::vector<RestError> rest_errors(const Robot& robot, const StartUpPlan& plan,
                                          const StartUpRun& run) {
  std::vector<RestError> errors;
  for (std::size_t k = 0; k < run.rests.size(); ++k) {
    const SampleRange& rows = run.rest_rows[k];
    const auto setpoint = static_cast<std::size_t>(run.rests[k].setpoint);
    const Pose& first = run.truth[static_cast<std::size_t>(rows.begin)].pose;
    const EquilibriumResult rest = direct_from_tensions(robot, plan.setpoint_N[setpoint], first);
    EXPECT_EQ(rest.status, EquilibriumStatus::found) << rest.reason;
    Vector6 mean = Vector6::Zero();
    for (Eigen::Index row = rows.begin; row < rows.end; ++row) {
      mean += minus(run.truth[static_cast<std::size_t>(row)].pose, rest.pose);
    }
    mean /= static_cast<double>(rows.size());
    errors.push_back({mean.head<3>().norm(), mean.tail<3>().norm()});
  }
  return errors;
}

}  // namespace cdprcal::test
