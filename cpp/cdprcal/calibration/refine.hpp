// After a first fit: noise from the readings themselves, and readings that do not belong.
#pragma once

#include <string>

#include "cdprcal/estimation/noise_estimate.hpp"

namespace cdprcal {

/// A reading that was left out of the fit.
struct GatedReading {
  enum class Reason { outlier, slack };
  Reason reason = Reason::outlier;
  double time_s = 0.0;
  Channel channel = Channel::length;
  int component = 0;   ///< cable or angle; 0 for a whole balance
  double size = kNaN;  ///< outlier: residual over its standard deviation; slack: tension [N]
};

struct Refinement {
  CalibrationProblem problem;       ///< with the noise found, without the gated readings
  CalibrationResult result;         ///< its solution
  std::vector<GatedReading> gated;  ///< in order of time
};

/// Takes cables that may hang slack (slack_level_N) out of a problem before any fit: that cable's
/// length and swivel and the pose's balance say nothing. σ of a tension is the noise of its
/// readings, and no less than the robot file's where the readings say that cables push. What the
/// problem knows of its load cells is counted in.
std::vector<GatedReading> gate_slack(CalibrationProblem& problem, const Signals& signals);

/// Estimates the noise from the residuals of a converged fit, solves again, gates outliers, and
/// repeats until the noise settles and nothing more is gated. Returns the first fit unchanged when
/// it had not converged. `signals`: see readings/signal.hpp.
Refinement refine(const CalibrationProblem& problem, const CalibrationResult& fit,
                  const Signals& signals, const SolveOptions& solve = {},
                  BalanceError balance = BalanceError::as_specified);

/// As noise and gates need a fit that is not the last: a worse one may still look contradicted.
SolveOptions on_the_way(const SolveOptions& options);

const char* to_string(GatedReading::Reason reason);

}  // namespace cdprcal
