#include "cdprcal/planning/known_effects.hpp"

#include "cdprcal/decompositions.hpp"
#include "cdprcal/effects/pose_evaluation.hpp"
#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/equilibria/wrench_distribution.hpp"
#include "cdprcal/statics/tension.hpp"

namespace cdprcal {
namespace {

constexpr int kMostNewtonSteps = 30;
constexpr double kBalanced = 1e-10;  ///< error ÷ weight, as in DirectOptions

Measurement at_rest(const CableVector& reading_N) {
  Measurement measurement;
  const auto n = reading_N.size();
  measurement.length_m = CableVector::Constant(n, kNaN);
  measurement.swivel_rad = CableVector::Constant(n, kNaN);
  measurement.tension_N = reading_N;
  return measurement;
}

/// The robot with what effects do to geometry and inertia.
Robot effective(const Robot& robot, const ActiveEffects& effects) {
  Robot changed = with_effects(robot, effects);
  changed.effects.clear();
  return changed;
}

}  // namespace

KnownEffects::KnownEffects(const Robot& robot)
    : robot_(robot), effects_(resolve_effects(robot, "")) {
  robot_ = effective(robot, effects_);
}

CableVector KnownEffects::tension_N(const Pose& pose, const CableVector& reading_N) const {
  const PlatformState state = platform_state(robot_, pose);
  const Measurement measurement = at_rest(reading_N);
  return corrected_tension_N({robot_, state, pose, measurement}, effects_, reading_N);
}

CableVector KnownEffects::reading_N(const Pose& pose, const CableVector& tension) const {
  // The reading whose corrected tension is `tension`, by fixed-point iteration: it converges
  // because the corrections change little when the reading does.
  CableVector reading = tension;
  for (int i = 0; i < 200; ++i) {
    const CableVector step = tension - tension_N(pose, reading);
    reading += step;
    if (step.cwiseAbs().maxCoeff() < 1e-12 * robot_.tension_max_N) break;
  }
  return reading;
}

std::optional<Pose> KnownEffects::settled(const CableVector& reading_N, const Pose& near) const {
  if (holds_orientation(robot_)) return near;
  const Measurement measurement = at_rest(reading_N);
  const double length_scale_m = characteristic_length_m(robot_);
  Pose pose = near;
  PoseEvaluation evaluation;
  for (int step = 0; step < kMostNewtonSteps; ++step) {
    evaluate_pose(robot_, measurement, pose, StaticsModel::wrench, {}, effects_, true, evaluation);
    if (!evaluation.valid || !evaluation.wrench.allFinite()) return std::nullopt;
    if (balance_error_N(evaluation.wrench, length_scale_m) <= kBalanced * robot_.weight_N()) {
      return pose;
    }
    const Vector6 twist = -solve_square(evaluation.wrench_by_twist, evaluation.wrench);
    // A step of the platform's own size is no small correction: another equilibrium, or none.
    if (!twist.allFinite() || twist.head<3>().norm() > length_scale_m ||
        twist.tail<3>().norm() > 1.0) {
      return std::nullopt;
    }
    pose = plus(pose, twist);
  }
  return std::nullopt;
}

std::optional<SetPoint> KnownEffects::as_planned(const SetPoint& stop) const {
  const CableVector tension = tension_N(stop.pose, stop.tension_N);
  if (!(tension.minCoeff() >= 0.0)) return std::nullopt;
  if (holds_orientation(robot_)) return SetPoint{stop.pose, tension};
  const EquilibriumResult rest = direct_from_tensions(robot_, tension, stop.pose);
  if (rest.status != EquilibriumStatus::found) return std::nullopt;
  return SetPoint{rest.pose, tension};
}

bool apply_known_effects(const KnownEffects& effects, Plan& plan, std::string& reason) {
  if (!effects.any()) return true;
  const auto apply = [&](Pose& pose, CableVector& tension_N, const std::string& what) {
    tension_N = effects.reading_N(pose, tension_N);
    const std::optional<Pose> settled = effects.settled(tension_N, pose);
    if (settled) {
      pose = *settled;
    } else {
      reason =
          "with the effects that the robot file lists the platform does not come to rest "
          "near " +
          what;
    }
    return settled.has_value();
  };
  if (!apply(plan.start_pose, plan.start_tension_N, "the start")) return false;
  for (std::size_t i = 0; i < plan.poses.size(); ++i) {
    PlannedPose& stop = plan.poses[i];
    if (!apply(stop.pose, stop.tension_N, "stop " + std::to_string(i + 1))) return false;
  }
  return true;
}

}  // namespace cdprcal
