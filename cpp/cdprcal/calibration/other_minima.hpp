// Whether another initial pose fits the readings about as well as the one that was found.
#pragma once

#include <vector>

#include "cdprcal/calibration/calibrate.hpp"

namespace cdprcal {

/// Rests that tell minima apart, and contradict one another where a map is wrong.
inline constexpr int kSeveral = 4;

/// Whether a fit may stand at a wrong minimum: poses misfit a geometric reading by more than it
/// scatters, which a wrong model does as well; or nothing says how much it may.
bool looks_wrong(const Calibration& calibration);

/// Whether two poses, so far apart, are farther from each other than a covariance calls possible.
bool is_far(const Vector6& apart, const Matrix6& covariance);

/// Few readings leave several minima, and a specified noise beyond the true one accepts all: the
/// lowest of all starts takes the place of the first, also where it is not to be trusted; and no
/// pose is claimed where another fits about as well. `prepared`: as it was before the fit; `ends`:
/// of the starts that it took.
void look_elsewhere(const CalibrateOptions& options, const Calibration& prepared,
                    const CalibrationResult& first, std::vector<CalibrationResult> ends,
                    Calibration& out);

}  // namespace cdprcal
