// The calibration as plain linear algebra, for other solvers, studies and tests.
#pragma once

#include "cdprcal/estimation/problem.hpp"

namespace cdprcal {

/// Whitened residuals (eq. 13 over σ) and their Jacobian at given poses. With r and J,
/// ½‖r‖² is the cost of eq. 14.
struct LinearisedProblem {
  Eigen::VectorXd residual;  ///< pose by pose: lengths, swivels, yaw, roll, pitch, absolute
                             ///< readings, statics
  Eigen::MatrixXd jacobian;  ///< six columns a pose (world-frame twist), then 2n + 1 reference
                             ///< errors (lengths, swivels, yaw; zero columns where held)
};

/// Linearises at `poses`, one a measurement, with reference errors `errors` (2n + 1; empty: zero).
/// Wrench rows are whitened at these poses. All is NaN where a pose has no geometry. Throws
/// InputError for a problem or sizes that solve() would refuse.
LinearisedProblem linearise(const CalibrationProblem& problem, const std::vector<Pose>& poses,
                            const Eigen::VectorXd& errors = {});

}  // namespace cdprcal
