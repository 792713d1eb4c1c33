// Errors that samples in motion share with their neighbours.
#pragma once

#include "cdprcal/calibration/calibrate.hpp"

namespace cdprcal {

/// How many moments are worth one independent reading: what is wrong at a place stays wrong nearby.
/// 1 + 2 Σ ρ_k, the autocorrelation of the residuals of `moments` (indices, in their order), until
/// it is gone (Sokal 1997).
double moments_a_reading(const std::vector<PoseResidual>& residuals,
                         const std::vector<std::size_t>& moments);

/// The same of the last so many.
double moments_a_reading(const std::vector<PoseResidual>& residuals, std::size_t last);

/// Counts what moments in motion share for one reading: of so many as are worth one, one stays in
/// the problem, which is fitted and refined again; where those show no pose the covariance grows
/// instead. As it was without noise from data, and where they are independent.
void leave_independent_moments(const CalibrateOptions& options, Calibration& calibration);

}  // namespace cdprcal
