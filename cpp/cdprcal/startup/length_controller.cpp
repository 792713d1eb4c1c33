#include "cdprcal/startup/length_controller.hpp"

#include <Eigen/LU>
#include <algorithm>

#include "cdprcal/geometry/fifth_degree.hpp"

namespace cdprcal {
namespace {

/// T: what the ramp has cut off is made up for within a few tenths of a second.
constexpr double kCatchUp_s = 0.2;

}  // namespace

LengthController::LengthController(const Robot& robot, const TensionControlOptions& options,
                                   double velocity_limit_m_s)
    : robot_(robot),
      options_(options),
      ramp_(robot.cable_count(), velocity_limit_m_s),
      start_m_(CableVector::Zero(robot.cable_count())),
      travelled_m_(CableVector::Zero(robot.cable_count())) {}

void LengthController::reset(const Pose& start) {
  start_m_ = platform_state(robot_, start).length_m();
  travelled_m_.setZero();
  ramp_.reset(CableVector::Zero(robot_.cable_count()));
}

void LengthController::lead(const std::vector<int>& by_tension, const Pose& at) {
  const CableVector length_m = platform_state(robot_, at).length_m();
  for (const int cable : by_tension_) start_m_[cable] = length_m[cable] - travelled_m_[cable];
  by_tension_ = by_tension;
}

CableVector LengthController::tension_feedback_m_s(const PlatformState& state,
                                                   const CableVector& error_N) const {
  CableVector velocity_m_s = CableVector::Zero(robot_.cable_count());
  const auto count = static_cast<Eigen::Index>(by_tension_.size());
  const TensionFamily family = wrench_family(robot_, state);
  if (count == 0 || !family.valid) return velocity_m_s;
  const double stiffness_N_m = options_.axial_stiffness_N / state.length_m().mean();
  CableMatrix rows(count, family.basis.cols());
  CableVector error(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const int cable = by_tension_[static_cast<std::size_t>(k)];
    rows.row(k) = family.basis.row(cable);
    error[k] = error_N[cable];
  }
  const CableMatrix answer = rows * rows.transpose();
  const CableVector gain = answer.partialPivLu().solve(error);
  for (Eigen::Index k = 0; k < count; ++k) {  // too little tension hauls in
    velocity_m_s[by_tension_[static_cast<std::size_t>(k)]] =
        -options_.locked_bandwidth_1_s / stiffness_N_m * gain[k];
  }
  return velocity_m_s;
}

const CableVector& LengthController::step(const HeldMotion& motion, double s, double s_by_time_1_s,
                                          const CableVector& error_N, double dt_s) {
  motion_ = motion;
  place_.reset(s, s_by_time_1_s);
  return follow(error_N, dt_s);
}

const CableVector& LengthController::follow(const CableVector& error_N, double dt_s) {
  travelled_m_ += dt_s * ramp_.commanded_m_s();
  const HeldPoint at = held_point(robot_, motion_, place_.s());
  if (!at.state.valid) {
    return ramp_.command_together(CableVector::Zero(robot_.cable_count()), dt_s);
  }
  CableVector wanted_m_s = length_jacobian(at.state) * (place_.s_by_time_1_s() * motion_.twist);
  const CableVector behind_m = at.state.length_m() - start_m_ - travelled_m_;
  std::vector<bool> follows(static_cast<std::size_t>(robot_.cable_count()), false);
  for (const int cable : by_tension_) follows[static_cast<std::size_t>(cable)] = true;
  for (int i = 0; i < robot_.cable_count(); ++i) {
    if (!follows[static_cast<std::size_t>(i)]) wanted_m_s[i] += behind_m[i] / kCatchUp_s;
  }
  wanted_m_s += tension_feedback_m_s(at.state, error_N);
  return ramp_.command_together(wanted_m_s, dt_s);
}

const CableVector& LengthController::stop(const CableVector& error_N, double dt_s) {
  place_.slow_down(dt_s);
  if (place_.s_by_time_1_s() > 0.0) return follow(error_N, dt_s);
  return ramp_.command_together(CableVector::Zero(robot_.cable_count()), dt_s);
}

double least_held_time_s(const Robot& robot, const HeldMotion& motion) {
  // Peak acceleration of a fifth-degree transition over its peak speed, times its duration.
  constexpr double kPeak = 5.7735 / 1.875;
  return std::max(kPeak * kFullSpeed_s, least_time_by_tension_s(robot, motion));
}

double held_transition_time_s(const Robot& robot, const HeldMotion& motion, double velocity_m_s) {
  double fastest = 0.0;
  constexpr int kPoints = 40;
  for (int i = 1; i < kPoints; ++i) {
    const double x = static_cast<double>(i) / kPoints;
    const PlatformState state =
        platform_state(robot, plus(motion.from, FifthDegree::value(x) * motion.twist));
    const CableVector by_fraction = length_jacobian(state) * motion.twist;
    fastest = std::max(fastest, FifthDegree::velocity(x) * by_fraction.cwiseAbs().maxCoeff());
  }
  return std::max(fastest / velocity_m_s, least_held_time_s(robot, motion));
}

}  // namespace cdprcal
