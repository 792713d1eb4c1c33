#include "cdprcal/readings/fresh.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "cdprcal/readings/rest_list.hpp"

namespace cdprcal {
namespace {

constexpr std::size_t kHasty = 10;       ///< one change of so many may come early
constexpr std::size_t kFewestGaps = 10;  ///< that a rate can be read from

bool is_read(const LogMatrix& readings, Eigen::Index row) {
  const double* const values = readings.data() + row * readings.cols();
  return std::any_of(values, values + readings.cols(), [](double v) { return std::isfinite(v); });
}

bool differs(const LogMatrix& readings, Eigen::Index row, Eigen::Index from) {
  const double* const now = readings.data() + row * readings.cols();
  const double* const before = readings.data() + from * readings.cols();
  for (Eigen::Index c = 0; c < readings.cols(); ++c) {
    if (now[c] != before[c] && std::isfinite(now[c])) return true;
  }
  return false;
}

/// Rows in which anything was read that was not there before.
std::vector<Eigen::Index> changes(const LogMatrix& readings, const SampleRange& range) {
  std::vector<Eigen::Index> out;
  out.reserve(static_cast<std::size_t>(range.size()));
  for (Eigen::Index row = range.begin; row < range.end; ++row) {
    if (out.empty() ? is_read(readings, row) : differs(readings, row, out.back())) {
      out.push_back(row);
    }
  }
  return out;
}

/// The middle one of the gaps that are no multiple of the shortest; 1 for a sensor without holds.
double hold_of(const std::vector<Eigen::Index>& changed) {
  if (changed.size() <= kFewestGaps) return 1.0;
  std::vector<Eigen::Index> gaps;
  std::size_t hasty = 0;
  for (std::size_t i = 1; i < changed.size(); ++i) {
    gaps.push_back(changed[i] - changed[i - 1]);
    if (gaps.back() == 1) ++hasty;
  }
  if (hasty > gaps.size() / kHasty) return 1.0;
  std::sort(gaps.begin(), gaps.end());
  const Eigen::Index shortest = gaps[gaps.size() / kHasty];
  const auto end = std::lower_bound(gaps.begin(), gaps.end(), 2 * shortest);
  return static_cast<double>(gaps[static_cast<std::size_t>(end - gaps.begin()) / 2]);
}

/// Polynomials through the two fresh readings before a row and the two behind it, as far as there
/// are any near: a straight line is off by a twentieth of a swing that is read sixteen times.
void fill_between(const LogMatrix& given, const Eigen::VectorXd& time_s, const FreshRows& fresh,
                  bool angle, LogMatrix& values) {
  const auto is_near = [&](std::size_t i) {  // to the one before
    const auto gap = static_cast<double>(fresh.rows[i] - fresh.rows[i - 1]);
    return gap <= 2.0 * fresh.hold_rows;
  };
  for (std::size_t i = 1; i < fresh.rows.size(); ++i) {
    if (!is_near(i)) continue;
    const std::size_t first = i > 1 && is_near(i - 1) ? i - 2 : i - 1;
    const std::size_t last = i + 1 < fresh.rows.size() && is_near(i + 1) ? i + 1 : i;
    const Eigen::RowVectorXd from = given.row(fresh.rows[i - 1]);
    for (Eigen::Index row = fresh.rows[i - 1] + 1; row < fresh.rows[i]; ++row) {
      Eigen::RowVectorXd value = from;
      for (std::size_t j = first; j <= last; ++j) {
        double weight = 1.0;  // Lagrange's
        for (std::size_t k = first; k <= last; ++k) {
          if (k == j) continue;
          weight *= (time_s[row] - time_s[fresh.rows[k]]) /
                    (time_s[fresh.rows[j]] - time_s[fresh.rows[k]]);
        }
        Eigen::RowVectorXd apart = given.row(fresh.rows[j]) - from;
        if (angle) apart = apart.unaryExpr(&wrap_angle);
        value += weight * apart;
      }
      values.row(row) = value;
    }
  }
}

}  // namespace

FreshRows fresh_rows(const LogMatrix& readings, const SampleRange& range) {
  FreshRows out;
  std::vector<Eigen::Index> changed;
  if (readings.cols() > 0) changed = changes(readings, range);
  out.hold_rows = hold_of(changed);
  if (out.are_all()) {
    out.rows.resize(static_cast<std::size_t>(range.size()));
    std::iota(out.rows.begin(), out.rows.end(), range.begin);
    return out;
  }
  changed.push_back(range.end);
  for (std::size_t i = 0; i + 1 < changed.size(); ++i) {
    const auto gap = static_cast<double>(changed[i + 1] - changed[i]);
    const double due = std::max(1.0, std::round(gap / out.hold_rows));
    for (double k = 0.0; k < due; ++k) {
      const Eigen::Index row = changed[i] + static_cast<Eigen::Index>(k * gap / due);
      if (is_read(readings, row)) out.rows.push_back(row);
    }
  }
  return out;
}

std::optional<Log> without_holds(const Log& log) {
  std::optional<Log> out;
  if (is_rest_list(log)) return out;  // alike there is at rest, not held
  const auto given = log.groups();
  for (const SampleRange& range : segments(log)) {
    for (std::size_t s = 0; s < kSensors; ++s) {
      const FreshRows fresh = fresh_rows(*given[s], range);
      if (fresh.are_all()) continue;
      if (!out) out = log;
      fill_between(*given[s], log.time_s, fresh, kSensorTable[s].is_angle(), *out->groups()[s]);
    }
  }
  return out;
}

std::optional<Log> rows_read_anew(const Log& log) {
  if (is_rest_list(log)) return std::nullopt;
  std::vector<Eigen::Index> rows;
  for (const SampleRange& range : segments(log)) {
    FreshRows longest;
    for (const LogMatrix* values : std::as_const(log).groups()) {
      FreshRows fresh = fresh_rows(*values, range);
      if (longest.rows.empty() || fresh.hold_rows > longest.hold_rows) longest = std::move(fresh);
    }
    rows.insert(rows.end(), longest.rows.begin(), longest.rows.end());
  }
  if (static_cast<Eigen::Index>(rows.size()) == log.sample_count()) return std::nullopt;
  Log out = log;
  out.time_s = log.time_s(rows);
  const auto given = std::as_const(log).groups();
  const auto taken = out.groups();
  for (std::size_t g = 0; g < taken.size(); ++g) *taken[g] = (*given[g])(rows, Eigen::all);
  return out;
}

}  // namespace cdprcal
