// The outer tension loop over winches in velocity mode (CiA-402 cyclic synchronous velocity).
//
//   v = v_ff − g F (τ_set − τ) filtered twice with time constant T
//
// F = J (K+Q)⁻¹ Jᵀ is how much cable the ideal robot's equilibrium lets out for a newton less, so
// that at low frequency every combination of tensions converges at the same rate g, however stiff
// or soft it is. Everything follows from the slowest natural frequency ω₁ of the ideal platform
// under constant tensions:
// - g = 0.4 ω₁: the platform follows the winches quasi-statically;
// - T = 0.4/ω₁: above ω₁ the platform answers with its inertia, and the gain g ω/ω₁² would rise for
//   ever. Filtered twice it falls as 2.5 ω₁/ω, and stays below 1 at the resonances of the cables,
//   which are lightly damped, and at the delays of drives and bus, up to about T/2.
// - Where n cables are almost one too many, F is small in some combination of them, and uncertain:
// a
//   wrong pose may make it many times too large. 3 % of the root of the largest is taken off the
//   root of each eigenvalue of F. What a locked cable of the stiffest kind foreseen stretches is
//   added, so that the loop also closes there. The pose hardly depends on that combination.
#pragma once

#include "cdprcal/acquisition/startup/path_model.hpp"

namespace cdprcal {

struct TensionControlOptions {
  double bandwidth = 0.4;          ///< g/ω₁
  double filter = 0.4;             ///< T ω₁
  double direction_error = 0.03;   ///< how far cable directions may be off the ideal ones [rad]
  double axial_stiffness_N = 1e7;  ///< EA of the stiffest cable foreseen
};

class TensionController {
 public:
  TensionController(int cable_count, const TensionControlOptions& options,
                    double velocity_limit_m_s);

  /// Takes over from a velocity [m/s].
  void reset(const CableVector& velocity_m_s);
  /// Gains for the point `fraction` of a leg.
  void tune(const PathLeg& leg, double fraction);
  /// Velocity [m/s] to command after `dt_s` with this tension error τ_set − τ [N] and feed-forward
  /// velocity; within the velocity limit, and changing by no more than the limit in 0.2 s.
  const CableVector& step(const CableVector& error_N, const CableVector& feed_forward_m_s,
                          double dt_s);
  /// Velocity while coming to a stop.
  const CableVector& stop(double dt_s);

 private:
  void command(const CableVector& wanted_m_s, double dt_s);

  TensionControlOptions options_;
  double limit_m_s_;
  CableMatrix gain_m_s_N_;        ///< g F
  double filter_s_ = 1.0;         ///< T
  CableVector once_N_, twice_N_;  ///< the error, filtered
  CableVector commanded_m_s_;
};

}  // namespace cdprcal
