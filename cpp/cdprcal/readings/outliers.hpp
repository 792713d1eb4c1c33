// Readings that stand out of those around them in time: a lost bit, a loose plug.
#pragma once

#include <vector>

#include "cdprcal/readings/log.hpp"

namespace cdprcal {

struct Outlier {
  Channel channel = Channel::length;
  int column = 0;  ///< of its sensor: cable, angle or axis
  double begin_s = 0.0, end_s = 0.0;
  double off = 0.0;  ///< from the median of those around [SI]
};

/// One or two readings of a run, one after the other, that stand out of those around them by eight
/// times the noise of the channel, three times the scatter nearby, and one σ of the robot file
/// (less does no harm): NaN in `log`. The first and last three of a run also by three times what
/// those beside them are apart, and as the only one at that time. Nothing is said of a list of
/// rests, nor of inertial sensors, which jerk with the platform. A reading that is held for several
/// rows is one.
std::vector<Outlier> leave_out_outliers(const SensorSigma& sigma, const SampleRange& run, Log& log);

}  // namespace cdprcal
