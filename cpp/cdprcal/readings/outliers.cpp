#include "cdprcal/readings/outliers.hpp"

#include <algorithm>
#include <array>

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

/// How far each reading is from the median of those around it; NaN at the ends and without
/// readings.
Eigen::VectorXd departures(const Eigen::VectorXd& values, bool angles) {
  Eigen::VectorXd out = Eigen::VectorXd::Constant(values.size(), kNaN);
  std::vector<double> around;
  for (Eigen::Index i = kBeside; i + kBeside < values.size(); ++i) {
    around.clear();
    for (Eigen::Index j = i - kBeside; j <= i + kBeside; ++j) {
      const double d = values[j] - values[i];
      if (std::isfinite(d)) around.push_back(angles ? wrap_angle(d) : d);
    }
    if (around.size() > 3) out[i] = -median(around);
  }
  return out;
}

/// Motion bends readings away from the median around them: judged by the scatter nearby.
bool is_outlier(const Eigen::VectorXd& off, Eigen::Index i, double least) {
  if (!(std::abs(off[i]) > least)) return false;
  Eigen::Index others = 0;
  double furthest = 0.0;
  for (Eigen::Index j = std::max<Eigen::Index>(0, i - kNearby);
       j < std::min(off.size(), i + kNearby + 1); ++j) {
    if (std::abs(j - i) <= kLongestOutlier || !std::isfinite(off[j])) continue;
    ++others;
    furthest = std::max(furthest, std::abs(off[j]));
  }
  return others >= 5 && std::abs(off[i]) > kAboveNearby * furthest;
}

Channel channel_of_column(const Sensor& sensor, int column) {
  const auto channels = channels_of(sensor);
  const auto behind = [&](const ChannelRow& row) { return row.first > column; };
  return channel_of(*std::prev(std::find_if(channels.begin(), channels.end(), behind)));
}

}  // namespace

std::vector<Outlier> leave_out_outliers(const SensorSigma& sigma, const SampleRange& run,
                                        Log& log) {
  std::vector<Outlier> out;
  if (is_rest_list(log)) return out;  // no reading has a neighbour to stand out from
  for_each_sensor(
      [&](const Sensor& sensor, LogMatrix& readings) {
        if (sensor.is_inertial() || readings.cols() == 0) return;
        std::vector<Eigen::Index> rows = fresh_rows(readings, run).rows;
        const auto count = static_cast<Eigen::Index>(rows.size());
        rows.push_back(run.end);
        const auto row_of_reading = [&](Eigen::Index i) {
          return rows[static_cast<std::size_t>(i)];
        };
        for (Eigen::Index c = 0; c < readings.cols(); ++c) {
          const Eigen::VectorXd values = Eigen::VectorXd::NullaryExpr(
              count, [&](Eigen::Index i) { return readings(row_of_reading(i), c); });
          const double noise = channel_noise(values, sensor.is_angle());
          const double least = std::max(sigma.*sensor.sigma, kOutlier * noise);
          const Eigen::VectorXd off = departures(values, sensor.is_angle());
          for (Eigen::Index i = 0; i < count; ++i) {
            if (!is_outlier(off, i, least)) continue;
            Eigen::Index end = i + 1;
            while (end < count && is_outlier(off, end, least)) ++end;
            if (end - i <= kLongestOutlier) {
              const Eigen::Index from = row_of_reading(i), until = row_of_reading(end);
              const int column = static_cast<int>(c);
              out.push_back({channel_of_column(sensor, column), column, log.time_s[from],
                             log.time_s[until - 1], off[i]});
              readings.col(c).segment(from, until - from).setConstant(kNaN);
            }
            i = end;
          }
        }
      },
      log);
  return out;
}

}  // namespace cdprcal
