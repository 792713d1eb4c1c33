// Whether the covariance can be believed: it comes from the slope of the model at the solution, and
// weak directions reach far beyond where that slope holds.
#pragma once

#include "cdprcal/estimation/problem.hpp"

namespace cdprcal {

/// By what factor a variance of ζ0, in whatever direction, is larger or smaller two standard
/// deviations away along the worst direction, up or down, all else fitted anew there. About 1 where
/// the linearisation holds; infinite where ζ0 is not even determined there. `result` must have a
/// covariance.
double variance_ratio_nearby(const CalibrationProblem& problem, const CalibrationResult& result);

}  // namespace cdprcal
