// Finds the intervals of a log in which the platform rests.
#pragma once

#include "cdprcal/acquisition/log.hpp"

namespace cdprcal {

struct DetectionOptions {
  double window_s = 1.0;        ///< the platform must look at rest at least this long
  double confidence = 0.999;    ///< of the tests that "nothing moves" is judged by
};

/// One interval at rest; `samples` are row numbers of the log.
struct Equilibrium {
  SampleRange samples;
  double begin_s = 0.0;
  double end_s = 0.0;
};

/// Equilibria in `range` of a log, in time order. Channels that are absent do not vote.
std::vector<Equilibrium> detect_equilibria(const Log& log, const SampleRange& range,
                                           const DetectionOptions& options = {});

}  // namespace cdprcal
