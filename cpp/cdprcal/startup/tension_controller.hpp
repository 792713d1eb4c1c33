// The outer tension loop over winches in velocity mode (CiA-402 cyclic synchronous velocity), for
// backends whose drives have no tension loop of their own.
//
//   v = v_ff − (g F filtered twice with time constant T + G)(τ_set − τ)
//
// Everything follows from the ideal robot at the set-point, its slowest natural frequency ω₁ under
// constant tensions, and the stiffness k of a cable:
// - F = J (K+Q)⁻¹ Jᵀ is how much cable the equilibrium lets out for a newton less. Below
//   ω₁ it makes all combinations of tensions converge at one rate g = 0.4 ω₁, however stiff or soft
//   they are.
// - Above ω₁ the platform answers with its inertia, and the gain g ω/ω₁² would rise for ever.
//   Filtered with T = 0.4/ω₁ it falls as 2.5 ω₁/ω, and stays below 1 at the lightly damped
//   resonances of the cables.
// - Where the cables are close to dependent, some combination of them hardly moves the platform and
//   only stretches. F is small there and uncertain: 3 % of the root of its trace is taken off the
//   roots of its eigenvalues. Instead G = r/k / (1 + k A/4r²), A = J M⁻¹ Jᵀ, closes the loop at the
//   bandwidth r there, and only there: in combinations that move the platform it is k A/4r² times
//   weaker. r leaves room for drives, bus and hold of together 20 ms.
// Simulated at 100 Hz with drives of 10 ms it is stable for cables from a third to four times as
// stiff as assumed. Much stiffer ones need a loop in the drive.
#pragma once

#include "cdprcal/startup/path_model.hpp"
#include "cdprcal/startup/winch_ramp.hpp"

namespace cdprcal {

struct TensionControlOptions {
  double bandwidth = 0.4;            ///< g/ω₁
  double filter = 0.4;               ///< T ω₁
  double direction_error = 0.03;     ///< how far cable directions may be off the ideal ones [rad]
  double axial_stiffness_N = 1.5e5;  ///< EA of the cables, and all they pull on, within a factor 3
  double locked_bandwidth_1_s = 22.0;  ///< r
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
  /// Velocity while nothing is read: towards a standstill.
  const CableVector& coast(double dt_s);
  /// Velocity while coming to a stop, within kFullSpeed_s of the reset to what the winches run at.
  const CableVector& stop(double dt_s) { return ramp_.slow_down(dt_s); }

 private:
  TensionControlOptions options_;
  CableMatrix slow_m_s_N_;        ///< g F
  CableMatrix fast_m_s_N_;        ///< G
  double filter_s_ = 1.0;         ///< T
  CableVector once_N_, twice_N_;  ///< the error, filtered
  WinchRamp ramp_;
};

}  // namespace cdprcal
