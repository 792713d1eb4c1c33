#include "cdprcal/readings/log.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <string_view>

#include "cdprcal/error.hpp"
#include "cdprcal/readings/log_columns.hpp"
#include "cdprcal/readings/rest_list.hpp"
#include "cdprcal/text.hpp"
#include "cdprcal/text_file.hpp"

namespace cdprcal {
namespace {

using detail::LogColumn;
using Eigen::Index;

/// The text line by line, counting from 1, without line ends.
class Lines {
 public:
  explicit Lines(std::string_view text) : rest_(text) {}

  bool next(std::string_view& line) {
    if (rest_.empty()) return false;
    const std::size_t end = rest_.find('\n');
    complete_ = end != std::string_view::npos;
    line = rest_.substr(0, end);
    rest_.remove_prefix(complete_ ? end + 1 : rest_.size());
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    ++number_;
    return true;
  }
  [[nodiscard]] std::size_t number() const { return number_; }
  /// The line ended with a line end: a file that stops without one may have been cut.
  [[nodiscard]] bool complete() const { return complete_; }

 private:
  std::string_view rest_;
  std::size_t number_ = 0;
  bool complete_ = false;
};

class LogParser {
 public:
  LogParser(std::string_view text, const std::string& source) : lines_(text), source_(source) {
    if (const std::size_t nul = text.find('\0'); nul != std::string_view::npos) {
      const auto line = 1 + std::count(text.begin(), text.begin() + nul, '\n');
      throw InputError(source + ":" + std::to_string(line) +
                       ": holds NUL bytes: this is a binary or damaged file; give "
                       "the log itself");
    }
    values_.reserve(text.size() / 8);  // a first guess of the bytes that a cell takes
  }

  Log parse() {
    read_header();
    read_rows();
    return make_log();
  }

 private:
  [[noreturn]] void fail(const std::string& problem) const {
    throw InputError(source_ + ":" + std::to_string(lines_.number()) + ": " + problem);
  }
  [[noreturn]] void fail_in(std::size_t column, const std::string& problem) const {
    fail("column " + columns_[column].name() + ": " + problem);
  }

  void read_header() {
    std::string_view line;
    while (lines_.next(line)) {
      line = trimmed(line);
      if (line.empty() || line.front() == '#') continue;
      columns_ = detail::parse_log_header(line, source_ + ":" + std::to_string(lines_.number()));
      time_column_ = static_cast<std::size_t>(
          std::find_if(columns_.begin(), columns_.end(), std::mem_fn(&LogColumn::is_time)) -
          columns_.begin());
      return;
    }
    throw InputError(source_ + ": is empty; a log must start with a header 'time_s,…'");
  }

  void read_rows() {
    std::string_view line;
    std::size_t blank_line = 0;
    while (lines_.next(line)) {
      const std::string_view content = trimmed(line);
      if (content.empty()) {
        if (blank_line == 0) blank_line = lines_.number();
        continue;
      }
      if (content.front() == '#') continue;  // what happened meanwhile, for people
      if (blank_line != 0) {
        throw InputError(source_ + ":" + std::to_string(blank_line) +
                         ": a blank line among the samples: delete it");
      }
      read_row(line);
    }
    if (row_count_ == 0) fail("no samples follow the header; log again");
  }

  void read_row(std::string_view line) {
    const std::size_t width = columns_.size();
    values_.resize(values_.size() + width);
    double* const row = &values_[values_.size() - width];
    const char* at = line.data();
    const char* const end = at + line.size();
    for (std::size_t column = 0; column < width; ++column) {
      const char* const begin = at;
      double value = kNaN;
      const auto [stop, status] = std::from_chars(at, end, value);
      if (status == std::errc{} && (stop == end || *stop == ',') && std::isfinite(value)) {
        at = stop;
      } else {
        at = std::find(begin, end, ',');
        value = slow_cell({begin, static_cast<std::size_t>(at - begin)}, column);
      }
      row[column] = value;
      const bool last = column + 1 == width;
      if (last ? at != end : at == end) ragged(line);
      if (!last) ++at;
    }
    check_time();
    ++row_count_;
  }

  /// A cell that is not simply a number: blank, nan, spaces around a number, or wrong.
  double slow_cell(std::string_view cell, std::size_t column) const {
    cell = trimmed(cell);
    if (cell.empty()) return kNaN;
    const std::string_view digits =
        cell.front() == '+' && cell.size() > 1 && cell[1] != '-' ? cell.substr(1) : cell;
    double value = kNaN;
    const auto [stop, status] =
        std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (status == std::errc::result_out_of_range) {
      fail_in(column, in_quotes(cell) + " is beyond double precision; check the number");
    }
    if (status != std::errc{} || stop != digits.data() + digits.size()) {
      fail_in(column,
              in_quotes(cell) + " is not a number; leave the cell empty where nothing was read");
    }
    if (std::isinf(value)) {
      fail_in(column, "infinite; leave the cell empty where nothing was read");
    }
    return value;
  }

  [[noreturn]] void ragged(std::string_view line) const {
    const auto cells = 1 + std::count(line.begin(), line.end(), ',');
    std::string problem = "has " + std::to_string(cells) + " cells, the header has " +
                          std::to_string(columns_.size());
    problem += lines_.complete() ? "; correct this line"
                                 : "; the file ends here and may be cut: delete this line";
    fail(problem);
  }

  void check_time() {
    const double time = values_[values_.size() - columns_.size() + time_column_];
    if (std::isnan(time)) fail_in(time_column_, "is empty: every sample needs its time");
    if (row_count_ > 0 && !(time > last_time_)) {
      fail_in(time_column_, "time must increase from row to row, but " + shortest(time) +
                                " follows " + shortest(last_time_));
    }
    last_time_ = time;
  }

  Log make_log() const {
    const auto width = static_cast<Index>(columns_.size());
    const Eigen::Map<const LogMatrix> table(values_.data(), row_count_, width);
    Log log;
    log.source = source_;
    for (Index column = 0; column < width; ++column) {
      const LogColumn& c = columns_[static_cast<std::size_t>(column)];
      if (c.is_time()) {
        log.time_s = table.col(column);
        continue;
      }
      LogMatrix& group = *log.groups()[c.group];
      if (group.cols() == 0) {
        group = LogMatrix::Constant(row_count_, detail::group_width(columns_, c.group), kNaN);
      }
      group.col(c.index) = table.col(column);
    }
    for (LogMatrix* group : log.groups()) {
      if (group->cols() == 0) group->resize(row_count_, 0);
    }
    return log;
  }

  Lines lines_;
  const std::string& source_;
  std::vector<LogColumn> columns_;
  std::size_t time_column_ = 0;
  std::vector<double> values_;  // row by row, in the order of the file's columns
  Index row_count_ = 0;
  double last_time_ = 0.0;
};

}  // namespace

std::array<LogMatrix*, kLogGroups> Log::groups() {
  std::array<LogMatrix*, kLogGroups> out;
  std::size_t next = 0;
  for_each_sensor([&](const Sensor&, LogMatrix& values) { out[next++] = &values; }, *this);
  out[next] = &tension_setpoint_N;
  return out;
}

std::array<const LogMatrix*, kLogGroups> Log::groups() const {
  std::array<const LogMatrix*, kLogGroups> out;
  std::ranges::copy(const_cast<Log*>(this)->groups(), out.begin());
  return out;
}

int Log::cable_count() const {
  Index widest = 0;
  for (std::size_t g = 0; g < kLogGroups; ++g) {
    if (kSensorTable[g].width == kOneACable) widest = std::max(widest, groups()[g]->cols());
  }
  return static_cast<int>(widest);
}

Log parse_log(const std::string& text, const std::string& source) {
  if (text.size() > kMostLogBytes) throw InputError(source + ": is over 1 GB: split it");
  // Lines are counted only in texts of at least as many bytes.
  const auto most_lines = static_cast<std::size_t>(kMostLogLines);
  if (text.size() > most_lines && std::count(text.begin(), text.end(), '\n') > kMostLogLines) {
    throw InputError(source + ": has over 5 million lines: split it, or log at a lower rate");
  }
  std::string_view body = text;
  if (body.starts_with("\xEF\xBB\xBF")) body.remove_prefix(3);
  return LogParser(body, source).parse();
}

Log read_log(const std::string& path) {
  return parse_log(read_text_file(path, kMostLogBytes + 1), path);
}

std::string format_log(const Log& log) {
  validate(log);
  const std::vector<LogColumn> columns = detail::columns_of(log);
  const auto groups = log.groups();
  std::string text;
  for (const LogColumn& c : columns) add_item(text, c.name(), ",");
  text += '\n';
  text.reserve(static_cast<std::size_t>(log.sample_count()) * columns.size() * 12);
  std::array<char, 32> number;
  for (Index row = 0; row < log.sample_count(); ++row) {
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const LogColumn& c = columns[i];
      const double value = c.is_time() ? log.time_s[row] : (*groups[c.group])(row, c.index);
      if (i > 0) text += ',';
      if (std::isnan(value)) continue;
      // The shortest text that reads as the value again.
      text.append(number.data(),
                  std::to_chars(number.data(), number.data() + number.size(), value).ptr);
    }
    text += '\n';
  }
  return text;
}

void write_log(const Log& log, const std::string& path) {
  write_text_file(path, format_log(log));  // complete before the file is touched
}

void validate(const Log& log) {
  const std::string source = log.source.empty() ? "log" : log.source;
  const Index samples = log.sample_count();
  if (samples == 0) throw InputError(source + ": holds no samples; log again");
  for (Index i = 0; i < samples; ++i) {
    if (!std::isfinite(log.time_s[i]) || (i > 0 && !(log.time_s[i] > log.time_s[i - 1]))) {
      throw InputError(source + ": time_s: must be finite and increase, but sample " +
                       std::to_string(i + 1) + " is at " + shortest(log.time_s[i]));
    }
  }
  const Index cables = log.cable_count();
  if (cables > kMaxCables) {
    throw InputError(source + ": " + std::to_string(cables) + " cables; at most " +
                     std::to_string(kMaxCables) + " are supported");
  }
  for (std::size_t g = 0; g < kLogGroups; ++g) {
    const LogMatrix& matrix = *log.groups()[g];
    if (matrix.cols() == 0) continue;
    const Sensor& sensor = kSensorTable[g];
    const std::string name = sensor.field();
    const Index width = sensor.columns_of(static_cast<int>(cables));
    if (matrix.cols() != width || matrix.rows() != samples) {
      throw InputError(source + ": " + name + ": has shape " + std::to_string(matrix.rows()) + "×" +
                       std::to_string(matrix.cols()) + ", expected " + std::to_string(samples) +
                       "×" + std::to_string(width) + " (samples × " +
                       (sensor.width == kOneACable ? "cables" : "components") +
                       "); give it that shape");
    }
    if (matrix.array().isInf().any()) {
      throw InputError(source + ": " + name + ": holds infinities; write NaN for an absent value");
    }
  }
}

bool is_rest_list(const Log& log, double gap_s) {
  const Index count = log.sample_count();
  if (count < 2 || count > kMostListedRests) return false;
  return (log.time_s.tail(count - 1) - log.time_s.head(count - 1)).minCoeff() > gap_s;
}

std::vector<SampleRange> segments(const Log& log, double gap_s) {
  if (is_rest_list(log, gap_s)) return {{0, log.sample_count()}};
  std::vector<SampleRange> ranges;
  Index begin = 0;
  for (Index i = 1; i <= log.sample_count(); ++i) {
    if (i == log.sample_count() || log.time_s[i] - log.time_s[i - 1] > gap_s) {
      ranges.push_back({begin, i});
      begin = i;
    }
  }
  return ranges;
}

}  // namespace cdprcal
