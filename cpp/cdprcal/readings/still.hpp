// How long the platform stayed where it was at the first sample.
#pragma once

#include "cdprcal/readings/signal.hpp"

namespace cdprcal {

/// The longest beginning of a range over which no mean wanders: its halves, quarters and eighths
/// agree in all channels together, within what the noise of single readings leaves of means (χ²,
/// 99 % each), and so do its first samples with the others; readings that stand out alone do not
/// count. Rest is judged by single readings, so a slow motion below their noise passes; their mean
/// would show it. At later rests that shifts only the pose of the rest, but the first rest defines
/// ζ0. A single sample where the second is off already. `signals`: of the run; without them
/// readings are taken for white. `begun_s`: from the run's first sample to the range's: filters
/// begin there.
SampleRange still_since_start(const Log& log, const SampleRange& range, const Signals& signals = {},
                              double begun_s = 0.0);

/// So few samples are no rest: what moves slowly or comes to rest there looks still in them.
inline constexpr Eigen::Index kFewestStill = 4;

/// The samples of a range whose mean is the place of the first: all that is still, or its first
/// half where what follows is not. A motion begins before it shows; the mean of all samples in
/// which it does not yet would be off by four of its standard deviations. Fewer than
/// kFewestStill where the platform moves at the start.
SampleRange at_the_start(const Log& log, const SampleRange& range, const Signals& signals = {},
                         double begun_s = 0.0);

}  // namespace cdprcal
