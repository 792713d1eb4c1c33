#include "cdprcal/readings/delimited_text.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <string>

#include "cdprcal/error.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

const char* find_in(const char* begin, const char* end, char wanted) {
  const void* found = std::memchr(begin, wanted, static_cast<std::size_t>(end - begin));
  return found == nullptr ? end : static_cast<const char*>(found);
}

/// A cell that is not simply digits up to the next comma. False: no number at all.
bool read_slowly(std::string_view cell, double& value) {
  value = kNaN;
  cell = trimmed(cell);
  if (cell.empty()) return true;
  if (cell.front() == '+' && cell.size() > 1 && cell[1] != '-') cell.remove_prefix(1);
  const char* const begin = cell.data();
  const char* const end = begin + cell.size();
  const auto [stop, status] = std::from_chars(begin, end, value);
  if (stop != end || status == std::errc::invalid_argument) return false;
  if (status == std::errc::result_out_of_range) {  // too large or too small: strtod tells which
    value = std::strtod(std::string(cell).c_str(), nullptr);
  }
  return true;
}

}  // namespace

TextLines text_lines(std::string_view text) {
  TextLines lines;
  const char* const begin = text.data();
  const char* const end = begin + text.size();
  lines.begin.push_back(0);
  for (const char* at = begin; at != end;) {
    const char* const stop = find_in(at, end, '\n');
    lines.commas.push_back(static_cast<std::int32_t>(std::count(at, stop, ',')));
    at = stop == end ? end : stop + 1;
    lines.begin.push_back(at - begin);
  }
  return lines;
}

NumberTable number_table(std::string_view text, std::span<const std::int64_t> begin,
                         std::span<const std::int64_t> columns) {
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i] < 0 || (i > 0 && columns[i] <= columns[i - 1])) {
      throw InputError("columns: must count from 0 and increase");
    }
  }
  const auto size = static_cast<std::int64_t>(text.size());
  NumberTable table;
  table.values.resize(static_cast<Eigen::Index>(begin.size()),
                      static_cast<Eigen::Index>(columns.size()));
  double* value = table.values.data();
  for (std::size_t line = 0; line < begin.size(); ++line) {
    if (begin[line] < 0 || begin[line] > size) {
      throw InputError("begin: line " + std::to_string(line) +
                       " begins outside the text; give offsets within");
    }
    const char* at = text.data() + begin[line];
    const char* const end = find_in(at, text.data() + size, '\n');
    std::int64_t here = 0;  // the column that `at` is in
    for (std::size_t c = 0; c < columns.size(); ++c, ++value) {
      for (; here < columns[c] && at != end; ++here) {
        at = find_in(at, end, ',');
        if (at != end) ++at;
      }
      const auto [stop, status] = std::from_chars(at, end, *value);
      if (status == std::errc{} && (stop == end || *stop == ',')) {
        at = stop;
        continue;
      }
      const char* const comma = find_in(at, end, ',');
      const std::string_view cell(at, static_cast<std::size_t>(comma - at));
      at = comma;
      if (read_slowly(cell, *value)) continue;
      table.wrong = {static_cast<std::int64_t>(line), static_cast<std::int64_t>(c), trimmed(cell)};
      table.values.conservativeResize(static_cast<Eigen::Index>(line), Eigen::NoChange);
      return table;
    }
  }
  return table;
}

}  // namespace cdprcal
