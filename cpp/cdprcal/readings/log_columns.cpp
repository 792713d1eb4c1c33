#include "cdprcal/readings/log_columns.hpp"

#include <algorithm>
#include <array>
#include <charconv>

#include "cdprcal/error.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal::detail {
namespace {

using Eigen::Index;
bool is_of_cables(const LogColumn& c) {
  return !c.is_time() && kSensorTable[c.group].width == kOneACable;
}

/// "length_1_m, …(one a cable), roll_rad, …": the names to choose from, those of cables first.
std::string known_columns() {
  std::string of_cables, of_platform;
  for (const Sensor& sensor : kSensorTable) {
    std::string& names = sensor.width == kOneACable ? of_cables : of_platform;
    for (int i = 0; i < std::max(1, sensor.width); ++i) names += ", " + sensor.column(i);
  }
  return "time_s" + of_cables + " (…one a cable)" + of_platform;
}

std::string_view strip(std::string_view text) {
  const auto space = [](char c) { return c == ' ' || c == '\t'; };
  while (!text.empty() && space(text.front())) text.remove_prefix(1);
  while (!text.empty() && space(text.back())) text.remove_suffix(1);
  return text;
}

LogColumn parse_column(std::string_view name, const std::string& place) {
  if (name == "time_s") return {};
  for (std::size_t g = 0; g < kLogGroups; ++g) {
    const Sensor& sensor = kSensorTable[g];
    for (int i = 0; i < sensor.width; ++i) {
      if (name == sensor.column(i)) return {g, i};
    }
    const std::string before = std::string(sensor.name) + "_",
                      after = std::string("_") + sensor.unit;
    if (sensor.width != kOneACable || name.size() <= before.size() + after.size() ||
        !name.starts_with(before) || !name.ends_with(after)) {
      continue;
    }
    const std::string_view digits =
        name.substr(before.size(), name.size() - before.size() - after.size());
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
    return {g, cable - 1};
  }
  const std::string hint = name.find_first_of(";\t") != std::string_view::npos
                               ? "columns must be separated by commas, or give a --map"
                           : name.empty() ? "delete its comma in every line, or give a --map"
                                          : "known are " + known_columns();
  throw InputError(place + ": column " + in_quotes(name) + ": unknown; " + hint);
}

void check_groups(const std::vector<LogColumn>& columns, const std::string& place) {
  const auto has = [&](std::size_t group, Index index) {
    return std::any_of(columns.begin(), columns.end(),
                       [&](const LogColumn& c) { return c.group == group && c.index == index; });
  };
  if (!has(LogColumn::kTime, 0)) throw InputError(place + ": column time_s: is missing; add it");
  Index cables = 0;
  LogColumn widest;
  for (const LogColumn& c : columns) {
    if (!is_of_cables(c) || c.index < cables) continue;
    cables = c.index + 1;
    widest = c;
  }
  // Every group that is there covers every cable: a sensor that is missing on one has empty cells.
  for (const LogColumn& c : columns) {
    if (!is_of_cables(c)) continue;
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
  return is_time() ? "time_s" : kSensorTable[group].column(static_cast<int>(index));
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
  std::vector<LogColumn> columns{{}};
  for (std::size_t g = 0; g < kLogGroups; ++g) {
    for (Index i = 0; i < log.groups()[g]->cols(); ++i) columns.push_back({g, i});
  }
  return columns;
}

Index group_width(const std::vector<LogColumn>& columns, std::size_t group) {
  const auto given = std::count_if(columns.begin(), columns.end(),
                                   [&](const LogColumn& c) { return c.group == group; });
  return given > 0 ? kSensorTable[group].columns_of(static_cast<int>(given)) : 0;
}

}  // namespace cdprcal::detail
