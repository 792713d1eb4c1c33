#include "cdprcal/startup/startup_checks.hpp"

#include "cdprcal/equilibria/wrench_distribution.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

/// Poses, where a plan has them: as many as set-points, each one that the cables hold. Where
/// tensions lead nobody needs them.
void check_poses(const Robot& robot, StartUpPlan& plan) {
  if (!holds_orientation(robot)) plan.pose.clear();
  if (plan.pose.empty()) return;
  if (plan.pose.size() != plan.setpoint_N.size()) {
    throw InputError("start-up plan: give as many poses as set-points, or none");
  }
  for (std::size_t k = 0; k < plan.pose.size(); ++k) {
    if (wrench_family(robot, platform_state(robot, plan.pose[k])).valid) continue;
    throw InputError(
        "start-up plan: the cables do not hold the platform at the pose of set-point " +
        std::to_string(k + 1) + "; make a plan with cdprcal plan");
  }
}

}  // namespace

double derived_velocity_m_s(const Robot& robot) {
  Vector3 middle = Vector3::Zero();
  for (const Cable& cable : robot.cables) middle += cable.pulley.position_m;
  middle /= robot.cable_count();
  double size = 0.0;
  for (const Cable& cable : robot.cables) size += (cable.pulley.position_m - middle).norm();
  size /= robot.cable_count();
  // One cable: its pulley is the middle. Take the platform's own size, or a metre.
  if (!(size > 1e-3)) size = 1.0;
  return 0.2 * size;
}

void check_options(const StartUpOptions& o) {
  const auto require = [](bool fine, const char* what) {
    if (!fine) throw InputError(std::string("start-up options: ") + what);
  };
  require(o.record_s >= 0.0 && o.measure_s >= 0.0 && o.settle_timeout_s > 0.0,
          "times must not be negative");
  require(o.velocity_limit_m_s >= 0.0, "velocity_limit_m_s must not be negative");
  require(o.control.bandwidth > 0.0 && o.control.filter > 0.0 && o.control.direction_error >= 0.0 &&
              o.control.axial_stiffness_N > 0.0,
          "control values must be positive");
  require(o.rest.window_s > 0.0 && o.rest.confidence > 0.0 && o.rest.confidence < 1.0 &&
              o.rest.tolerance >= 0.0,
          "rest: window_s must be above 0, confidence between 0 and 1, tolerance 0 or more");
}

void check_plan(const Robot& robot, StartUpPlan& plan) {
  if (plan.setpoint_N.empty()) throw InputError("start-up plan: no set-points; give at least one");
  for (std::size_t k = 0; k < plan.setpoint_N.size(); ++k) {
    const CableVector& t = plan.setpoint_N[k];
    const std::string name = "start-up plan: set-point " + std::to_string(k + 1);
    if (t.size() != robot.cable_count() || !t.allFinite()) {
      throw InputError(name + ": give " + std::to_string(robot.cable_count()) +
                       " finite tensions, one a cable");
    }
    if (t.minCoeff() < robot.tension_min_N || t.maxCoeff() > robot.tension_max_N) {
      throw InputError(name + ": a tension is outside the robot's limits; give one within");
    }
  }
  if (plan.transition_s.empty()) plan.transition_s.assign(plan.setpoint_N.size(), 0.0);
  if (plan.transition_s.size() != plan.setpoint_N.size()) {
    throw InputError("start-up plan: give as many transition times as set-points, or none");
  }
  if (!plan.via.empty() && plan.via.size() != plan.setpoint_N.size()) {
    throw InputError("start-up plan: say of every set-point whether it is via, or of none");
  }
  check_poses(robot, plan);
  for (const double t : plan.transition_s) {
    if (!(t >= 0.0) || std::isinf(t))
      throw InputError("start-up plan: transition_s must be 0 or more");
  }
}

}  // namespace cdprcal
