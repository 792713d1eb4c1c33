// Noise from the residuals of a fit: variance components, one channel at a time.
#pragma once

#include <vector>

#include "cdprcal/estimation/problem.hpp"

namespace cdprcal {

struct FittedRow;

/// Where the model's own error starts from: errors of an attitude sensor that stay over a rest look
/// like those of the balance, so the residuals may leave open which of the two are there.
enum class BalanceError {
  as_specified,  ///< what the robot file says
  as_geometry,   ///< as good a share of it as lengths and swivels are of theirs
};

/// The `pose` component of each channel that makes the residuals most likely, given the `sample`
/// component that the readings' own ripple shows (readings/signal.hpp). Residuals are corrected for
/// what the fit took out of them (1 − leverage; restricted maximum likelihood with the leverages
/// held). The balance has a second component, what the model itself is wrong by: forces, and
/// moments of these forces at the platform's characteristic length (when `problem.noise` has other
/// proportions, only those are put right: fit again first). A channel with less than one degree of
/// freedom keeps the noise it was fitted with; the model's own error starts from what the robot
/// file says, which counts as four readings. Never below the ripple of a mean (Signal::variance).
/// `rows`: of the fit at `problem.noise`.
NoiseModel noise_from_residuals(const CalibrationProblem& problem,
                                const std::vector<FittedRow>& rows, const Signals& signals,
                                BalanceError balance = BalanceError::as_specified);

}  // namespace cdprcal
