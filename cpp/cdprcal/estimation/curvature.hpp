// Whether the covariance can be believed: it comes from the slope of the model at the solution, and
// weak directions reach far beyond where that slope holds.
#pragma once

#include "cdprcal/estimation/problem.hpp"

namespace cdprcal {

/// Where all rotations are known better [rad] the slope holds.
inline constexpr double kFarRotation_rad = 1.5 * kDegree;

/// By what factor a variance of ζ0, in whatever direction, is larger or smaller two standard
/// deviations away along the worst direction, up or down, all else fitted anew there. About 1 where
/// the linearisation holds; infinite where ζ0 is not even determined there. A tenth of the work of
/// `nearby`. `result` must have a covariance.
double variance_ratio_nearby(const CalibrationProblem& problem, const CalibrationResult& result);

/// ζ0 with what its neighbourhood says.
struct Nearby {
  double widening = 1.0;  ///< how many times as far as the covariance says it may be, at most
  Matrix6 covariance;     ///< as much wider
};

/// Profile likelihoods of the rotations of ζ0 (Bates and Watts, "Nonlinear regression analysis and
/// its applications", 1988, §6.1): held some way about each principal axis of their covariance, all
/// else fitted anew, the cost should rise by t²/2 at t standard deviations. The widening is the
/// factor on the standard deviation with which it nowhere rises by less, where it does not rise so
/// far that nobody would believe it; infinite where it falls. Where all rotations are known to a
/// degree and a half the slope holds, and nothing is asked. `result` must be a minimum with a
/// covariance, its reference one with noise.
Nearby nearby(const CalibrationProblem& problem, const CalibrationResult& result);

}  // namespace cdprcal
