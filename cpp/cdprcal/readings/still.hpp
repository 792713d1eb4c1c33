// How long the platform stayed where it was at the first sample.
#pragma once

#include "cdprcal/readings/signal.hpp"

namespace cdprcal {

/// The longest beginning of a range over which no mean wanders: its halves, quarters and eighths
/// agree in all channels together, within what the noise of single readings leaves of means (χ²,
/// 95 % each). Rest is
/// judged by single readings, so a slow motion below their noise passes; their mean would show it.
/// At later rests that shifts only the pose of the rest, but the first rest defines ζ0. Never less
/// than `least` samples. `signals`: of the run; without them readings are taken for white.
SampleRange still_since_start(const Log& log, const SampleRange& range, const Signals& signals = {},
                              Eigen::Index least = 4);

}  // namespace cdprcal
