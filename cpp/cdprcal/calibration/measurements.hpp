// Which samples of a log show which pose: the measurements of a calibration's problem.
#pragma once

#include <optional>

#include "cdprcal/calibration/calibrate.hpp"
#include "cdprcal/readings/path_state.hpp"

namespace cdprcal {

/// One single sample for each time of options.at_s, of the method's kind. Throws InputError for a
/// time that is not within the run or names a sample twice.
void measure_by_hand(const Log& log, const PathState& path, const SampleRange& run,
                     const CalibrateOptions& options, Calibration& out);

/// The mean of each of out.equilibria, the first of which is the reference where the run began in
/// it, and, unless the method is static, samples in motion between them. `given`: the samples that
/// show the initial pose, where that is known.
void measure_automatically(const Log& log, const PathState& path, const SampleRange& run,
                           const CalibrateOptions& options, const std::optional<SampleRange>& given,
                           Calibration& out);

}  // namespace cdprcal
