// How long the platform stayed where it was at the first sample.
#pragma once

#include "cdprcal/readings/log.hpp"

namespace cdprcal {

/// The longest beginning of a range over which no mean wanders: its two halves agree in all
/// channels together, within what the noise of single readings leaves of means (χ², 95 %). Rest is
/// judged by single readings, and a motion far below their noise is above that of their mean. What
/// differs at another pose has a pose of its own to differ by; the first one is ζ0 itself. Never
/// less than `least` samples.
SampleRange still_since_start(const Log& log, const SampleRange& range, Eigen::Index least = 4);

}  // namespace cdprcal
