// First readings that are worse than those that follow: a low-pass starts at its first reading,
// whose noise it has not reduced yet.
#pragma once

#include <optional>

#include "cdprcal/calibration/calibrate.hpp"

namespace cdprcal {

/// The samples that show the initial pose better than the first one does; nothing where that one is
/// as good as it should be. Where the first sample is cut off from what follows, the platform
/// moved, or its readings are off by more than the noise of the others. The platform moves as one
/// body: the changes of all lengths, swivels and angles are those of six coordinates. Changes that
/// are not (χ², 99.9 %, of what a change of pose leaves of them) are errors; the samples after it
/// that agree with each other hold the start then. Beside many that do, or such as have forgotten
/// what a filter began with, any change is an error but a large one that only a motion makes: a
/// filter that is faster than the log may begin with a reading several σ off. `log`: as `fitted`
/// read it. `run`: its samples.
std::optional<SampleRange> unsettled_start(const Log& log, const SampleRange& run,
                                           const Calibration& fitted, double window_s);

}  // namespace cdprcal
