// Private to readings/: the columns of the canonical log and where they live in a Log.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cdprcal/readings/log.hpp"

namespace cdprcal::detail {

/// One column of a canonical log.
struct LogColumn {
  enum class Group {
    time,
    length,
    swivel,
    tension,
    tension_setpoint,
    attitude,
    absolute_yaw,
    direct_length,
    position
  };
  Group group = Group::time;
  Eigen::Index index = 0;  ///< cable; or 0, 1, 2 = roll, pitch, yaw or x, y, z

  [[nodiscard]] std::string name() const;  ///< as in the file: "length_1_m"
};

/// The groups that are matrices, by the name of their field in Log.
inline constexpr std::array<std::pair<LogColumn::Group, const char*>, 8> kLogGroups{
    {{LogColumn::Group::length, "length_m"},
     {LogColumn::Group::swivel, "swivel_rad"},
     {LogColumn::Group::tension, "tension_N"},
     {LogColumn::Group::tension_setpoint, "tension_setpoint_N"},
     {LogColumn::Group::attitude, "roll_pitch_yaw_rad"},
     {LogColumn::Group::absolute_yaw, "absolute_yaw_rad"},
     {LogColumn::Group::direct_length, "direct_length_m"},
     {LogColumn::Group::position, "position_m"}}};

/// Columns of a group of the platform, whatever the number of cables; 0: one a cable (or time).
Eigen::Index platform_width(LogColumn::Group group);

/// Columns of a header line. Throws InputError "place: column …" for unknown, duplicate or missing
/// columns and for cable groups with gaps or of different widths.
std::vector<LogColumn> parse_log_header(std::string_view line, const std::string& place);

/// The columns that format_log writes for a log.
std::vector<LogColumn> columns_of(const Log& log);

/// Width of the matrix that holds a group: cables in the header, or platform_width.
Eigen::Index group_width(const std::vector<LogColumn>& columns, LogColumn::Group group);

/// The matrix of a group (not time).
LogMatrix& log_group(Log& log, LogColumn::Group group);
const LogMatrix& log_group(const Log& log, LogColumn::Group group);

/// Shortest decimal that reads back as the same double.
std::string number_text(double value);

}  // namespace cdprcal::detail
