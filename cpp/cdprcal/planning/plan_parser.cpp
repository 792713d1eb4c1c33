#include "cdprcal/planning/plan_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <string_view>

#include "cdprcal/error.hpp"
#include "cdprcal/planning/plan_columns.hpp"
#include "cdprcal/readings/log_columns.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

using detail::constant_tension_column;
using detail::kPoseColumns;
using detail::natural_column;
using detail::tension_column;

constexpr double kNormTolerance = 1e-6;
constexpr Eigen::Index kMostModes = 6;

/// A piece of a line and where it stands.
struct Cell {
  std::string_view text;   ///< trimmed
  std::size_t column = 1;  ///< of the line, from 1
};

std::vector<Cell> split(std::string_view line, std::size_t offset = 0) {
  std::vector<Cell> cells;
  for (std::size_t begin = 0;;) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    const std::string_view raw = line.substr(begin, end - begin);
    const std::string_view text = trimmed(raw);
    const auto lead = text.empty() ? 0 : static_cast<std::size_t>(text.data() - raw.data());
    cells.push_back({text, offset + begin + lead + 1});
    if (end == line.size()) return cells;
    begin = end + 1;
  }
}

class PlanParser {
 public:
  PlanParser(std::string_view text, const std::string& source) : text_(text), source_(source) {}

  Plan parse() {
    std::string_view line;
    bool have_header = false;
    while (next(line)) {
      if (const std::size_t nul = line.find('\0'); nul != std::string_view::npos) {
        fail(nul + 1, "holds NUL bytes: this is a binary or damaged file; give a plan");
      }
      const std::string_view content = trimmed(line);
      if (content.empty()) continue;
      if (content.front() == '#') {
        read_comment(line);
      } else if (!have_header) {
        read_header(line);
        have_header = true;
      } else {
        read_row(line);
      }
    }
    if (!have_header) fail(1, "holds no table; a plan must have a header 'purpose,position_x_m,…'");
    finish();
    return plan_;
  }

 private:
  [[noreturn]] void fail(std::size_t column, const std::string& problem) const {
    throw InputError(source_ + ":" + std::to_string(std::max<std::size_t>(number_, 1)) + ":" +
                     std::to_string(column) + ": " + problem);
  }

  bool next(std::string_view& line) {
    if (at_ >= text_.size()) return false;
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    line = text_.substr(at_, end - at_);
    at_ = end + 1;
    ++number_;
    return true;
  }

  double number(const Cell& cell, const std::string& what, bool may_be_nan = false) const {
    double value = kNaN;
    const char* const begin = cell.text.data();
    const char* const end = begin + cell.text.size();
    const auto [stop, status] = std::from_chars(begin, end, value);
    if (status != std::errc{} || stop != end) {
      fail(cell.column, what + ": must be a number, not " + in_quotes(cell.text));
    }
    if (!std::isfinite(value) && !(may_be_nan && std::isnan(value))) {
      fail(cell.column, what + ": must be finite, not " + in_quotes(cell.text));
    }
    return value;
  }

  double not_negative(const Cell& cell, const std::string& what) const {
    const double value = number(cell, what);
    if (value < 0.0) fail(cell.column, what + ": must not be negative");
    return value;
  }

  double tension(const Cell& cell, const std::string& what) const {
    const double value = number(cell, what);
    if (!(value > 0.0)) fail(cell.column, what + ": a tension must be positive [N]");
    return value;
  }

  Eigen::Quaterniond quaternion(const Eigen::Vector4d& q, std::size_t column) const {
    if (!(std::abs(q.norm() - 1.0) <= kNormTolerance)) {
      fail(column, "the quaternion's norm must be 1, not " + shortest(q.norm()));
    }
    return {q[0], q[1], q[2], q[3]};  // as it is: normalising would change its last bits
  }

  /// "# key: values"; comments of other forms are for people.
  void read_comment(std::string_view line) {
    const std::size_t hash = line.find('#');
    const std::size_t colon = line.find(':', hash);
    if (colon == std::string_view::npos) return;
    const std::string key(trimmed(line.substr(hash + 1, colon - hash - 1)));
    const std::map<std::string, void (PlanParser::*)(const std::vector<Cell>&)> known{
        {"robot", &PlanParser::set_robot},
        {"start_tension_N", &PlanParser::set_start_tension},
        {"start_position_m", &PlanParser::set_start_position},
        {"start_quaternion_wxyz", &PlanParser::set_start_quaternion},
        {"start_dwell_s", &PlanParser::set_start_dwell},
        {"stops", &PlanParser::set_stops},
        {"predicted_standard_deviation_m_rad", &PlanParser::set_standard_deviation}};
    const auto setter = known.find(key);
    if (setter == known.end()) return;
    if (!seen_.insert({key, number_}).second) {
      fail(hash + 1, "'# " + key + ":' appears twice, first on line " +
                         std::to_string(seen_.at(key)) + "; delete one");
    }
    if (key == "robot") {  // a name may hold commas
      const std::string_view name = trimmed(line.substr(colon + 1));
      (this->*setter->second)({{name, colon + 2}});
    } else {
      (this->*setter->second)(split(line.substr(colon + 1), colon + 1));
    }
  }

  void expect(const std::vector<Cell>& cells, std::size_t count, const char* what) const {
    if (cells.size() == count) return;
    fail(cells.front().column, std::string(what) + ": has " + std::to_string(cells.size()) +
                                   " values; give " + std::to_string(count));
  }
  void set_robot(const std::vector<Cell>& cells) {
    if (cells[0].text.empty()) fail(cells[0].column, "robot: the name is missing; add it");
    const auto control = [](unsigned char c) { return c < ' '; };
    if (std::any_of(cells[0].text.begin(), cells[0].text.end(), control)) {
      fail(cells[0].column, "robot: the name must not hold control characters");
    }
    plan_.robot_name = std::string(cells[0].text);
  }
  void set_start_tension(const std::vector<Cell>& cells) {
    if (cells.size() > static_cast<std::size_t>(kMaxCables)) {
      fail(cells[0].column, "start_tension_N: at most " + std::to_string(kMaxCables) + " cables");
    }
    plan_.start_tension_N.resize(static_cast<Eigen::Index>(cells.size()));
    for (std::size_t i = 0; i < cells.size(); ++i) {
      plan_.start_tension_N[static_cast<Eigen::Index>(i)] = tension(cells[i], "start_tension_N");
    }
  }
  void set_start_position(const std::vector<Cell>& cells) {
    expect(cells, 3, "start_position_m");
    for (int a = 0; a < 3; ++a) {
      plan_.start_pose.position_m[a] = number(cells[a], "start_position_m");
    }
  }
  void set_start_quaternion(const std::vector<Cell>& cells) {
    expect(cells, 4, "start_quaternion_wxyz");
    Eigen::Vector4d q;
    for (int a = 0; a < 4; ++a) q[a] = number(cells[a], "start_quaternion_wxyz");
    plan_.start_pose.rotation = quaternion(q, cells[0].column);
  }
  void set_start_dwell(const std::vector<Cell>& cells) {
    expect(cells, 1, "start_dwell_s");
    plan_.start_dwell_s = not_negative(cells[0], "start_dwell_s");
  }
  void set_stops(const std::vector<Cell>& cells) {
    expect(cells, 1, "stops");
    stops_ = number(cells[0], "stops");
  }
  void set_standard_deviation(const std::vector<Cell>& cells) {
    expect(cells, 6, "predicted_standard_deviation_m_rad");
    for (int a = 0; a < 6; ++a) {
      plan_.predicted_standard_deviation[a] =
          number(cells[a], "predicted_standard_deviation_m_rad", true);
    }
  }

  /// How many columns of a numbered family there are; they must be 1, 2, … without a gap.
  template <class Name>
  Eigen::Index family(const Name& name, Eigen::Index most) const {
    Eigen::Index count = 0;
    while (count < most && columns_.contains(name(count))) ++count;
    return count;
  }

  void read_header(std::string_view line) {
    const std::vector<Cell> cells = split(line);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const std::string name(cells[i].text);
      if (!columns_.insert({name, i}).second) {
        fail(cells[i].column, "column " + in_quotes(name) + " appears twice; delete one");
      }
    }
    width_ = cells.size();
    cables_ = family(tension_column, kMaxCables);
    natural_modes_ = family(natural_column, kMostModes);
    constant_tension_modes_ = family(constant_tension_column, kMostModes);
    std::map<std::string, bool> known{{"purpose", true}, {"transition_s", true}, {"dwell_s", true}};
    for (const char* name : kPoseColumns) known[name] = true;
    for (Eigen::Index i = 0; i < std::max<Eigen::Index>(cables_, 1); ++i) {
      known[tension_column(i)] = true;
    }
    for (Eigen::Index i = 0; i < natural_modes_; ++i) known[natural_column(i)] = true;
    for (Eigen::Index i = 0; i < constant_tension_modes_; ++i) {
      known[constant_tension_column(i)] = true;
    }
    for (const Cell& cell : cells) {
      if (known.contains(std::string(cell.text))) continue;
      if (cell.text == "time_s") {
        fail(cell.column, "unknown column 'time_s', as logs have it; give a plan (cdprcal plan)");
      }
      fail(cell.column, "unknown column " + in_quotes(cell.text) +
                            "; delete it (numbered columns must count from 1 without a gap)");
    }
    for (const auto& [name, required] : known) {
      if (!columns_.contains(name)) fail(1, "column '" + name + "' is missing; add it");
    }
  }

  void read_row(std::string_view line) {
    const std::vector<Cell> cells = split(line);
    if (cells.size() != width_) {
      fail(cells.back().column, "has " + std::to_string(cells.size()) + " cells, the header has " +
                                    std::to_string(width_) +
                                    "; make the plan anew, it may be cut here");
    }
    const auto cell = [&](const std::string& name) { return cells[columns_.at(name)]; };
    PlannedPose stop;
    const Cell purpose = cell("purpose");
    if (purpose.text != "measure" && purpose.text != "via") {
      fail(purpose.column, "purpose: " + in_quotes(purpose.text) + " is neither measure nor via");
    }
    stop.measured = purpose.text == "measure";
    Eigen::Matrix<double, 7, 1> pose;
    for (int a = 0; a < 7; ++a) pose[a] = number(cell(kPoseColumns[a]), kPoseColumns[a]);
    stop.pose.position_m = pose.head<3>();
    stop.pose.rotation = quaternion(pose.tail<4>(), cell("quaternion_w").column);
    stop.tension_N.resize(cables_);
    for (Eigen::Index i = 0; i < cables_; ++i) {
      stop.tension_N[i] = tension(cell(tension_column(i)), tension_column(i));
    }
    stop.transition_s = not_negative(cell("transition_s"), "transition_s");
    stop.dwell_s = not_negative(cell("dwell_s"), "dwell_s");
    stop.natural_frequencies_hz.resize(natural_modes_);
    for (Eigen::Index i = 0; i < natural_modes_; ++i) {
      stop.natural_frequencies_hz[i] = not_negative(cell(natural_column(i)), natural_column(i));
    }
    stop.constant_tension_frequencies_hz.resize(constant_tension_modes_);
    for (Eigen::Index i = 0; i < constant_tension_modes_; ++i) {
      stop.constant_tension_frequencies_hz[i] =
          not_negative(cell(constant_tension_column(i)), constant_tension_column(i));
    }
    plan_.poses.push_back(stop);
  }

  void finish() {
    for (const char* key : {"robot", "start_tension_N", "start_position_m", "start_quaternion_wxyz",
                            "start_dwell_s", "stops"}) {
      if (!seen_.contains(key))
        fail(1, std::string("the comment '# ") + key + ": …' is missing; add it");
    }
    if (plan_.start_tension_N.size() != cables_) {
      fail(1, "start_tension_N has " + std::to_string(plan_.start_tension_N.size()) +
                  " values, but the table has the tensions of " + std::to_string(cables_) +
                  " cables; give one a cable");
    }
    if (static_cast<double>(plan_.poses.size()) != stops_ || plan_.poses.empty()) {
      fail(1, "holds " + std::to_string(plan_.poses.size()) + " stops where " + shortest(stops_) +
                  " are announced; make the plan anew, it may be cut");
    }
    plan_.duration_s = plan_.start_dwell_s;
    for (const PlannedPose& stop : plan_.poses) {
      plan_.duration_s += stop.transition_s + stop.dwell_s;
    }
  }

  std::string_view text_;
  const std::string& source_;
  std::size_t at_ = 0;
  std::size_t number_ = 0;  ///< line, from 1
  Plan plan_;
  double stops_ = -1.0;
  std::map<std::string, std::size_t> seen_;     ///< header comment → line
  std::map<std::string, std::size_t> columns_;  ///< name → place in a row
  std::size_t width_ = 0;
  Eigen::Index cables_ = 0;
  Eigen::Index natural_modes_ = 0;
  Eigen::Index constant_tension_modes_ = 0;
};

}  // namespace

Plan parse_plan(const std::string& text, const std::string& source) {
  if (text.size() > kMostPlanBytes) {
    throw InputError(source + ": is over 64 MB: this is not a plan; give one");
  }
  std::string_view body = text;
  if (body.starts_with("\xEF\xBB\xBF")) body.remove_prefix(3);
  return PlanParser(body, source).parse();
}

}  // namespace cdprcal
