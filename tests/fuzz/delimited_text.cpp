// Lines, columns and numbers of any text: what the importers are built on.
#include "cdprcal/readings/delimited_text.hpp"

#include <algorithm>
#include <array>

#include "target.hpp"

using fuzz::require;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::text_of(data, size);
  const cdprcal::TextLines lines = cdprcal::text_lines(text);
  const std::size_t count = lines.commas.size();
  require(lines.begin.size() == count + 1 && lines.begin.front() == 0, "the first line");
  require(lines.begin.back() == static_cast<std::int64_t>(size), "the end");
  std::int64_t commas = 0;
  for (std::size_t i = 0; i < count; ++i) {
    require(lines.begin[i] < lines.begin[i + 1], "an empty line");
    require(lines.begin[i] == 0 || text[static_cast<std::size_t>(lines.begin[i]) - 1] == '\n',
            "a line begins elsewhere");
    commas += lines.commas[i];
  }
  require(commas == std::count(text.begin(), text.end(), ','), "commas");

  constexpr std::array<std::int64_t, 3> columns{0, 2, 3};
  const std::span<const std::int64_t> begin(lines.begin);  // one more: nothing, at the very end
  const cdprcal::NumberTable table = cdprcal::number_table(text, begin, columns);
  const auto rows = static_cast<std::size_t>(table.values.rows());
  require(table.values.cols() == 3, "columns");
  require(rows == (table.wrong ? static_cast<std::size_t>(table.wrong->line) : count + 1), "rows");
  if (table.wrong) {
    const cdprcal::WrongCell& wrong = *table.wrong;
    require(wrong.column >= 0 && wrong.column < 3 && !wrong.text.empty(), "a wrong cell");
    require(wrong.text.find_first_of(",\n") == std::string_view::npos, "more than one cell");
  }
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const bool there = row < count && columns[c] <= lines.commas[row];
      const double value = table.values(static_cast<Eigen::Index>(row), static_cast<int>(c));
      require(there || std::isnan(value), "a number where the line has ended");
    }
  }
  return 0;
}
