// Logs that hold one row a rest, as people write them down who measure by hand.
#pragma once

#include "cdprcal/readings/log.hpp"

namespace cdprcal {

/// Nobody measures more by hand; a log with milliseconds for seconds has more rows.
inline constexpr Eigen::Index kMostListedRests = 400;

/// Whether no two of so few rows follow each other within `gap_s`, which would make every row a run
/// of its own: each is then the reading of one rest, and all of them are one run.
bool is_rest_list(const Log& log, double gap_s = 2.0);

}  // namespace cdprcal
