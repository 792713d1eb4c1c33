// Lines and columns of delimited text of any kind, found in one pass and turned into numbers
// without copies. The canonical log has a reader of its own (log.hpp); this serves importers.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "cdprcal/readings/log.hpp"

namespace cdprcal {

/// Where the lines of a text begin and how many commas each holds.
struct TextLines {
  std::vector<std::int64_t> begin;   ///< [lines + 1]: bytes; the last is the text's size
  std::vector<std::int32_t> commas;  ///< [lines]
};

/// The lines of `text`. A line ends with \n, which belongs to it; the last may lack it.
TextLines text_lines(std::string_view text);

/// A cell that is no number.
struct WrongCell {
  std::int64_t line = 0;    ///< index into the lines asked for
  std::int64_t column = 0;  ///< index into the columns asked for
  std::string_view text;    ///< without the blanks around it
};

/// Numbers from some columns of some lines.
struct NumberTable {
  LogMatrix values;                ///< [lines, columns]; NaN for a blank cell
  std::optional<WrongCell> wrong;  ///< the first cell that is no number: `values` ends before it
};

/// Reads the columns `columns` (from 0, increasing) of the lines that begin at `begin`, cells
/// separated by commas. A number may have a sign, blanks around it, or be inf or nan; one beyond
/// double precision is ±inf or 0. A column that a line does not have is a blank cell. Throws
/// InputError for columns that do not increase and for lines outside the text.
NumberTable number_table(std::string_view text, std::span<const std::int64_t> begin,
                         std::span<const std::int64_t> columns);

}  // namespace cdprcal
