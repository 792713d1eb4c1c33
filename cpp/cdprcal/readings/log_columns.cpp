#include "cdprcal/readings/log_columns.hpp"

#include <algorithm>
#include <charconv>
#include <stdexcept>

#include "cdprcal/error.hpp"
#include "cdprcal/text_file.hpp"

namespace cdprcal::detail {
namespace {

using Eigen::Index;
using Group = LogColumn::Group;

struct CableGroup {
  Group group;
  std::string_view before;  // of the cable number
  std::string_view after;
};

constexpr std::array<CableGroup, 5> kCableGroups{
    {{Group::length, "length_", "_m"},
     {Group::swivel, "swivel_", "_rad"},
     {Group::tension, "tension_", "_N"},
     {Group::tension_setpoint, "tension_setpoint_", "_N"},
     {Group::direct_length, "direct_length_", "_m"}}};

struct PlatformColumn {
  Group group;
  Index index;
  const char* name;
};
constexpr std::array<PlatformColumn, 7> kPlatformColumns{
    {{Group::attitude, 0, "roll_rad"},
     {Group::attitude, 1, "pitch_rad"},
     {Group::attitude, 2, "yaw_rad"},
     {Group::absolute_yaw, 0, "absolute_yaw_rad"},
     {Group::position, 0, "position_x_m"},
     {Group::position, 1, "position_y_m"},
     {Group::position, 2, "position_z_m"}}};

bool is_of_cables(Group group) { return group != Group::time && platform_width(group) == 0; }

const CableGroup& cable_group(Group group) {
  return *std::find_if(kCableGroups.begin(), kCableGroups.end(),
                       [&](const CableGroup& g) { return g.group == group; });
}

std::string_view strip(std::string_view text) {
  const auto space = [](char c) { return c == ' ' || c == '\t'; };
  while (!text.empty() && space(text.front())) text.remove_prefix(1);
  while (!text.empty() && space(text.back())) text.remove_suffix(1);
  return text;
}

LogColumn parse_column(std::string_view name, const std::string& place) {
  if (name == "time_s") return {Group::time, 0};
  for (const PlatformColumn& c : kPlatformColumns) {
    if (name == c.name) return {c.group, c.index};
  }
  for (const CableGroup& g : kCableGroups) {
    if (name.size() <= g.before.size() + g.after.size() || !name.starts_with(g.before) ||
        !name.ends_with(g.after)) {
      continue;
    }
    const std::string_view digits =
        name.substr(g.before.size(), name.size() - g.before.size() - g.after.size());
    int cable = 0;
    const auto [stop, status] =
        std::from_chars(digits.data(), digits.data() + digits.size(), cable);
    if (status != std::errc{} || stop != digits.data() + digits.size() || digits[0] == '0') {
      continue;
    }
    if (cable < 1 || cable > kMaxCables) {
      throw InputError(place + ": column " + std::string(name) + ": cables are numbered 1 to " +
                       std::to_string(kMaxCables));
    }
    return {g.group, cable - 1};
  }
  const std::string hint =
      name.find_first_of(";\t") != std::string_view::npos
          ? "columns must be separated by commas"
          : "known are time_s, length_1_m, swivel_1_rad, tension_1_N, "
            "tension_setpoint_1_N, direct_length_1_m (…one a cable), roll_rad, pitch_rad, "
            "yaw_rad, absolute_yaw_rad, position_x_m, position_y_m, position_z_m";
  throw InputError(place + ": column " + in_quotes(name) + ": unknown; " + hint);
}

void check_groups(const std::vector<LogColumn>& columns, const std::string& place) {
  const auto has = [&](Group group, Index index) {
    return std::any_of(columns.begin(), columns.end(),
                       [&](const LogColumn& c) { return c.group == group && c.index == index; });
  };
  if (!has(Group::time, 0)) throw InputError(place + ": column time_s: is missing; add it");
  Index cables = 0;
  LogColumn widest;
  for (const LogColumn& c : columns) {
    if (!is_of_cables(c.group) || c.index < cables) continue;
    cables = c.index + 1;
    widest = c;
  }
  // Every group that is there covers every cable: a sensor that is missing on one has empty cells.
  for (const LogColumn& c : columns) {
    if (!is_of_cables(c.group)) continue;
    for (Index i = 0; i < cables; ++i) {
      if (has(c.group, i)) continue;
      throw InputError(place + ": column " + LogColumn{c.group, i}.name() +
                       ": is missing, though " + widest.name() +
                       " is there; leave its cells empty if that sensor does not exist");
    }
  }
}

}  // namespace

std::string LogColumn::name() const {
  if (group == Group::time) return "time_s";
  for (const PlatformColumn& c : kPlatformColumns) {
    if (c.group == group && c.index == index) return c.name;
  }
  const CableGroup& g = cable_group(group);
  return std::string(g.before) + std::to_string(index + 1) + std::string(g.after);
}

std::vector<LogColumn> parse_log_header(std::string_view line, const std::string& place) {
  std::vector<LogColumn> columns;
  while (true) {
    const std::size_t comma = line.find(',');
    const LogColumn column = parse_column(strip(line.substr(0, comma)), place);
    for (const LogColumn& other : columns) {
      if (other.group == column.group && other.index == column.index) {
        throw InputError(place + ": column " + column.name() + ": given twice; delete one");
      }
    }
    columns.push_back(column);
    if (comma == std::string_view::npos) break;
    line.remove_prefix(comma + 1);
  }
  check_groups(columns, place);
  return columns;
}

std::vector<LogColumn> columns_of(const Log& log) {
  std::vector<LogColumn> columns{{Group::time, 0}};
  for (const Group group :
       {Group::length, Group::swivel, Group::tension, Group::attitude, Group::absolute_yaw,
        Group::direct_length, Group::position, Group::tension_setpoint}) {
    for (Index i = 0; i < log_group(log, group).cols(); ++i) columns.push_back({group, i});
  }
  return columns;
}

Index group_width(const std::vector<LogColumn>& columns, Group group) {
  const auto of_group = [&](const LogColumn& c) { return c.group == group; };
  if (const Index width = platform_width(group); width > 0) {
    return std::any_of(columns.begin(), columns.end(), of_group) ? width : 0;
  }
  return std::count_if(columns.begin(), columns.end(), of_group);
}

Index platform_width(Group group) {
  return std::count_if(kPlatformColumns.begin(), kPlatformColumns.end(),
                       [&](const PlatformColumn& c) { return c.group == group; });
}

const LogMatrix& log_group(const Log& log, Group group) {
  switch (group) {
    case Group::length:
      return log.length_m;
    case Group::swivel:
      return log.swivel_rad;
    case Group::tension:
      return log.tension_N;
    case Group::tension_setpoint:
      return log.tension_setpoint_N;
    case Group::attitude:
      return log.roll_pitch_yaw_rad;
    case Group::absolute_yaw:
      return log.absolute_yaw_rad;
    case Group::direct_length:
      return log.direct_length_m;
    case Group::position:
      return log.position_m;
    case Group::time:
      break;
  }
  throw std::logic_error("time is not a matrix");
}

LogMatrix& log_group(Log& log, Group group) {
  return const_cast<LogMatrix&>(log_group(static_cast<const Log&>(log), group));
}

std::string number_text(double value) {
  std::array<char, 32> text;
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

}  // namespace cdprcal::detail
