// The winches of six cables and more: lengths lead the platform's pose, and n−6 cables follow
// tensions, so that the others are neither slack nor overloaded whatever the lengths are off by.
//
//   v = ∂l/∂ζ ζ̇ + (l(ζ) − l(ζ₀) − ∫v) / T     of the six that hold the pose
//   v = ∂l/∂ζ ζ̇ − G (τ_set − τ)               of the others, for drives in velocity mode
//
// Tension control of all cables would leave the pose to them, and where cables pull from all sides
// or cross each other it is not even stable there. With n−6 of them under tension the rest is
// statics, and the pose is as stiff as the cables are.
//
// The lengths count from where the platform hangs at power-on. Nobody knows that yet: the run goes
// through the plan's poses moved by as much as the first of them was missed by.
#pragma once

#include <vector>

#include "cdprcal/equilibria/held_motion.hpp"
#include "cdprcal/startup/tension_controller.hpp"

namespace cdprcal {

class LengthController {
 public:
  /// Of the options those count that a stretched cable asks for.
  LengthController(const Robot& robot, const TensionControlOptions& options,
                   double velocity_limit_m_s);

  /// Takes over from a standstill, at the pose ζ₀ as far as anybody knows.
  void reset(const Pose& start);
  /// From now on these follow tensions (cables_led_by_tension), at this pose. A cable that led by
  /// its tension has the length which that asked for, and holds it.
  void lead(const std::vector<int>& by_tension, const Pose& at);
  /// Velocity [m/s] to command after `dt_s`, at a fraction s of a motion and at ds/dt, with this
  /// tension error τ_set − τ [N].
  const CableVector& step(const HeldMotion& motion, double s, double s_by_time_1_s,
                          const CableVector& error_N, double dt_s);
  /// Velocity while coming to a stop within kFullSpeed_s, on along the way of the last step: cables
  /// that stop each for itself would pull against each other.
  const CableVector& stop(const CableVector& error_N, double dt_s);

 private:
  /// G: with the pose held, tensions τ_S of cables S answer their lengths by −k N_S N_Sᵀ.
  [[nodiscard]] CableVector tension_feedback_m_s(const PlatformState& state,
                                                 const CableVector& error_N) const;
  /// To where place_ is on motion_, at its rate.
  const CableVector& follow(const CableVector& error_N, double dt_s);

  Robot robot_;
  std::vector<int> by_tension_;
  TensionControlOptions options_;
  WinchRamp ramp_;
  CableVector start_m_, travelled_m_;
  HeldMotion motion_;  ///< of the last step
  PlaceOnLeg place_;
};

/// Shortest time [s] of a fifth-degree transition along a motion at whatever speed: no cable comes
/// to it faster than the drives' ramp, nor loses much of its pull.
double least_held_time_s(const Robot& robot, const HeldMotion& motion);

/// The same where no cable runs faster than `velocity_m_s`, either.
double held_transition_time_s(const Robot& robot, const HeldMotion& motion, double velocity_m_s);

}  // namespace cdprcal
