#include "cdprcal/readings/outliers.hpp"

#include <algorithm>
#include <limits>

#include "cdprcal/readings/fresh.hpp"
#include "cdprcal/readings/rest_list.hpp"
#include "cdprcal/readings/signal.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal {
namespace {

/// Beyond so many σ no sample of a run of any length is by chance.
constexpr double kOutlier = 8.0;
/// And so many times as far off as any reading nearby: motion bends readings, too.
constexpr double kAboveNearby = 3.0;
/// Readings on either side that an outlier is compared with, and that its scatter is taken from.
constexpr Eigen::Index kBeside = 3, kNearby = 10;
/// More than this in a row is motion, not an outlier.
constexpr Eigen::Index kLongestOutlier = 2;
/// So many readings nearby may stand out, too, and be outliers: more are an oscillation.
constexpr Eigen::Index kMostOdd = 2;

/// How far each reading is from the median of those around it; NaN without readings. At the ends,
/// where motion is to one side only, NaN where those beside it are as far from each other.
Eigen::VectorXd departures(const Eigen::VectorXd& values, bool angles) {
  Eigen::VectorXd out = Eigen::VectorXd::Constant(values.size(), kNaN);
  std::vector<double> around;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const Eigen::Index begin = std::max<Eigen::Index>(0, i - kBeside);
    const Eigen::Index end = std::min(values.size(), i + kBeside + 1);
    around.clear();
    double least = std::numeric_limits<double>::infinity(), most = -least;  // of the others
    for (Eigen::Index j = begin; j < end; ++j) {
      const double d = angles ? wrap_angle(values[j] - values[i]) : values[j] - values[i];
      if (!std::isfinite(d)) continue;
      around.push_back(d);
      if (j == i) continue;
      least = std::min(least, d);
      most = std::max(most, d);
    }
    if (around.size() <= 3) continue;
    const double off = -median(around);
    const bool at_end = static_cast<Eigen::Index>(around.size()) <= 2 * kBeside;  // or at a gap
    if (!at_end || std::abs(off) > kAboveNearby * (most - least)) out[i] = off;
  }
  return out;
}

/// Which readings are beyond `least`, one or two in a row: motion goes on for longer.
std::vector<bool> stand_alone(const Eigen::VectorXd& off, double least) {
  std::vector<bool> out(static_cast<std::size_t>(off.size()), false);
  for (Eigen::Index i = 0; i < off.size(); ++i) {
    Eigen::Index end = i;
    while (end < off.size() && std::abs(off[end]) > least) ++end;
    if (end - i <= kLongestOutlier) std::fill(out.begin() + i, out.begin() + end, true);
    i = end;
  }
  return out;
}

/// Motion bends readings away from the median around them: judged by the scatter nearby, of which
/// others that stand alone are no part while they are few.
bool is_outlier(const Eigen::VectorXd& off, const std::vector<bool>& alone, Eigen::Index i,
                double least) {
  if (!(std::abs(off[i]) > least)) return false;
  Eigen::Index others = 0, odd = 0;
  double furthest = 0.0, furthest_odd = 0.0;
  for (Eigen::Index j = std::max<Eigen::Index>(0, i - kNearby);
       j < std::min(off.size(), i + kNearby + 1); ++j) {
    if (std::abs(j - i) <= kLongestOutlier || !std::isfinite(off[j])) continue;
    const bool is_odd = alone[static_cast<std::size_t>(j)];
    ++(is_odd ? odd : others);
    double& most = is_odd ? furthest_odd : furthest;
    most = std::max(most, std::abs(off[j]));
  }
  if (odd > kMostOdd) furthest = std::max(furthest, furthest_odd);
  return others >= 5 && std::abs(off[i]) > kAboveNearby * furthest;
}

Channel channel_of_column(const Sensor& sensor, int column) {
  const auto channels = channels_of(sensor);
  const auto behind = [&](const ChannelRow& row) { return row.first > column; };
  return channel_of(*std::prev(std::find_if(channels.begin(), channels.end(), behind)));
}

/// One that was found, and where.
struct Found {
  Outlier outlier;
  LogMatrix* readings;
  Eigen::Index from, until;  ///< rows
  bool at_end;               ///< of the run
};

/// At the ends motion is to one side only, and where several readings stand out at once it is
/// motion: a platform that moved off at once, a low-pass that starts.
bool is_motion(const Found& one, const std::vector<Found>& all) {
  return one.at_end && std::any_of(all.begin(), all.end(), [&](const Found& other) {
           const bool same =
               other.readings == one.readings && other.outlier.column == one.outlier.column;
           return !same && other.from < one.until && one.from < other.until;
         });
}

/// Of some rows those that have a reading in a column; −1, several times, where many in a row have
/// none: what is beyond is no neighbour.
std::vector<Eigen::Index> with_readings(const LogMatrix& readings, Eigen::Index column,
                                        const std::vector<Eigen::Index>& rows) {
  std::vector<Eigen::Index> out;
  Eigen::Index empty = 0;
  for (const Eigen::Index row : rows) {
    if (!std::isfinite(readings(row, column))) {
      ++empty;
      continue;
    }
    if (empty > kNearby && !out.empty()) out.insert(out.end(), 2 * kNearby, -1);
    empty = 0;
    out.push_back(row);
  }
  return out;
}

}  // namespace

std::vector<Outlier> leave_out_outliers(const SensorSigma& sigma, const SampleRange& run,
                                        Log& log) {
  std::vector<Outlier> out;
  if (is_rest_list(log)) return out;  // no reading has a neighbour to stand out from
  std::vector<Found> found;
  for_each_sensor(
      [&](const Sensor& sensor, LogMatrix& readings) {
        if (sensor.is_inertial() || readings.cols() == 0) return;
        const std::vector<Eigen::Index> fresh = fresh_rows(readings, run).rows;
        for (Eigen::Index c = 0; c < readings.cols(); ++c) {
          // As many on either side, also where cells are empty: a cable that moves is further off
          // on one side than on the other.
          const std::vector<Eigen::Index> rows = with_readings(readings, c, fresh);
          const auto count = static_cast<Eigen::Index>(rows.size());
          const auto row_of_reading = [&](Eigen::Index i) {
            return rows[static_cast<std::size_t>(i)];
          };
          const Eigen::VectorXd values = Eigen::VectorXd::NullaryExpr(count, [&](Eigen::Index i) {
            const Eigen::Index row = row_of_reading(i);
            return row < 0 ? kNaN : readings(row, c);
          });
          const double noise = channel_noise(values, sensor.is_angle());
          const double least = std::max(sigma.*sensor.sigma, kOutlier * noise);
          const Eigen::VectorXd off = departures(values, sensor.is_angle());
          const std::vector<bool> alone = stand_alone(off, least);
          for (Eigen::Index i = 0; i < count; ++i) {
            if (!is_outlier(off, alone, i, least)) continue;
            Eigen::Index end = i + 1;
            while (end < count && is_outlier(off, alone, end, least)) ++end;
            if (end - i <= kLongestOutlier) {
              const Eigen::Index from = row_of_reading(i);
              const auto next = std::ranges::upper_bound(fresh, row_of_reading(end - 1));
              const Eigen::Index until = next == fresh.end() ? run.end : *next;
              const int column = static_cast<int>(c);
              found.push_back({{channel_of_column(sensor, column), column, log.time_s[from],
                                log.time_s[until - 1], off[i]},
                               &readings,
                               from,
                               until,
                               i < kBeside || end + kBeside > count});
            }
            i = end;
          }
        }
      },
      log);
  for (const Found& one : found) {
    if (is_motion(one, found)) continue;
    one.readings->col(one.outlier.column).segment(one.from, one.until - one.from).setConstant(kNaN);
    out.push_back(one.outlier);
  }
  return out;
}

}  // namespace cdprcal
