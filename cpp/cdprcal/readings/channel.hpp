// Groups of readings that share one noise level: model/sensors.hpp has them, one row each.
#pragma once

#include "cdprcal/model/sensors.hpp"

namespace cdprcal {

/// Which row of a residual is which reading.
struct RowLabel {
  Channel channel = Channel::length;
  int component = 0;          ///< cable, angle (0 roll, 1 pitch, 2 yaw), axis or wrench row
  bool of_reference = false;  ///< the error of a reading at the reference, not a reading
};

}  // namespace cdprcal
