// Private to readings/: the columns of the canonical log and where they live in a Log.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "cdprcal/readings/log.hpp"

namespace cdprcal::detail {

/// One column of a canonical log.
struct LogColumn {
  static constexpr std::size_t kTime = kLogGroups;
  std::size_t group = kTime;  ///< row of kSensorTable, or time
  Eigen::Index index = 0;     ///< cable; or 0, 1, 2 = roll, pitch, yaw or x, y, z

  [[nodiscard]] bool is_time() const { return group == kTime; }
  [[nodiscard]] std::string name() const;  ///< as in the file: "length_1_m"
};

/// Columns of a header line. Throws InputError "place: column …" for unknown, duplicate or missing
/// columns and for cable groups with gaps or of different widths.
std::vector<LogColumn> parse_log_header(std::string_view line, const std::string& place);

/// The columns that format_log writes for a log.
std::vector<LogColumn> columns_of(const Log& log);

/// Width of the matrix that holds a group: 0 where the header has none of it.
Eigen::Index group_width(const std::vector<LogColumn>& columns, std::size_t group);

}  // namespace cdprcal::detail
