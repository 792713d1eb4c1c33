#include "cdprcal/readings/lengths.hpp"

namespace cdprcal {

LogMatrix* read_lengths(Log& log) {
  if (log.length_m.cols() > 0) return &log.length_m;
  LogMatrix* whole = nullptr;
  for_each_absolute(
      [&](const Sensor& sensor, LogMatrix& readings) {
        const bool of_cables = sensor.is_length() && sensor.width == kOneACable;
        if (of_cables && readings.cols() > 0) whole = &readings;
      },
      log);
  return whole;
}

const LogMatrix* read_lengths(const Log& log) { return read_lengths(const_cast<Log&>(log)); }

}  // namespace cdprcal
