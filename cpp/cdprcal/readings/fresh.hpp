// Sensors that are logged faster than they read: which rows hold a fresh reading.
#pragma once

#include <optional>
#include <vector>

#include "cdprcal/readings/log.hpp"

namespace cdprcal {

/// Rows of a range in which one sensor read anew.
struct FreshRows {
  double hold_rows = 1.0;          ///< rows a fresh reading, 1: every row has one
  std::vector<Eigen::Index> rows;  ///< of the log; all of the range where nothing is held
  [[nodiscard]] bool are_all() const { return hold_rows == 1.0; }
};

/// A sensor is held when hardly a reading is followed by another in the next row: nine of ten
/// changes of any of its columns (empty cells are no reading) are at least two rows after the last
/// one. A fresh reading that happens to repeat the last one, as coarse ones do at rest, is counted
/// where it was due.
FreshRows fresh_rows(const LogMatrix& readings, const SampleRange& range);

/// The log with cubics between the fresh readings of held sensors, so that all columns of a row are
/// of one time, also while the platform moves; longer gaps stay as they are. Nothing where
/// no sensor is held.
std::optional<Log> without_holds(const Log& log);

/// The rows in which the sensor read anew that is held longest; nothing where no sensor is held.
std::optional<Log> rows_read_anew(const Log& log);

}  // namespace cdprcal
