#include "cdprcal/readings/measurement.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "cdprcal/error.hpp"
#include "cdprcal/readings/log_checks.hpp"
#include "cdprcal/readings/odd_readings.hpp"

namespace cdprcal {
namespace {

/// Mean of the finite entries of each column over the rows of `range`; NaN without any.
/// `angles`: taken about the first finite entry, so that a wrap between samples does no harm.
/// `readings`: of sensors, of which some may be odd.
CableVector column_means(const LogMatrix& values, const SampleRange& range, int columns,
                         bool angles, bool readings = false) {
  CableVector mean = CableVector::Constant(columns, kNaN);
  std::vector<double> since_first;
  for (Eigen::Index c = 0; c < std::min<Eigen::Index>(columns, values.cols()); ++c) {
    double first = kNaN;
    since_first.clear();
    for (Eigen::Index row = range.begin; row < range.end; ++row) {
      const double value = values(row, c);
      if (!std::isfinite(value)) continue;
      if (since_first.empty()) first = value;
      since_first.push_back(angles ? wrap_angle(value - first) : value - first);
    }
    if (since_first.empty()) continue;
    if (readings) leave_out_odd(since_first);
    mean[c] = first + std::accumulate(since_first.begin(), since_first.end(), 0.0) /
                          static_cast<double>(since_first.size());
  }
  return mean;
}

}  // namespace

std::span<double> readings_of(Measurement& m, const Sensor& sensor) {
  std::span<double> out;
  for_each_sensor(
      [&](const Sensor& other, auto& reading) {
        if (&other == &sensor) out = numbers(reading);
      },
      m);
  return out;
}

Eigen::Map<const Eigen::VectorXd> readings_of(const Measurement& m, Channel channel) {
  const ChannelRow& row = row_of(channel);
  if (channel == Channel::angular_velocity) return {nullptr, 0};
  if (channel == Channel::specific_force && !m.rests()) return {nullptr, 0};
  const std::span<double> all = readings_of(const_cast<Measurement&>(m), row.of());
  const auto size = static_cast<Eigen::Index>(all.size()) - row.first;
  return {all.data() + row.first, std::min<Eigen::Index>(size, row.count)};
}

int doubled_readings(const Measurement& m) {
  int count = 0;
  for (const ChannelRow& relative : kChannelTable) {
    for (const ChannelRow& whole : kChannelTable) {
      const bool alike = relative.has_offset && !whole.has_offset && whole.of().is_absolute() &&
                         relative.count == whole.count &&
                         relative.of().is_angle() == whole.of().is_angle();
      if (!alike) continue;
      const auto a = readings_of(m, channel_of(relative)), b = readings_of(m, channel_of(whole));
      for (Eigen::Index c = 0; c < std::min(a.size(), b.size()); ++c) {
        if (std::isfinite(a[c]) && std::isfinite(b[c])) ++count;
      }
    }
  }
  return count;
}

int spare_readings(const Measurement& m, int unknowns) {
  int count = 0;
  for (const ChannelRow& row : kChannelTable) {
    if (channel_of(row) == Channel::balance) continue;
    count += static_cast<int>(readings_of(m, channel_of(row)).array().isFinite().count());
  }
  return spare_rows(m, count, unknowns);
}

Measurement measurement_at(const Log& log, Eigen::Index index, PoseKind kind, int cable_count) {
  Measurement m = measurement_mean(log, {index, index + 1}, kind, cable_count);
  m.time_s = log.time_s[index];
  return m;
}

Measurement measurement_mean(const Log& log, const SampleRange& range, PoseKind kind,
                             int cable_count) {
  require_samples(range, log);
  if (cable_count < 0 || cable_count > kMaxCables) {
    throw InputError("cable_count: is " + std::to_string(cable_count) + "; give 0 to " +
                     std::to_string(kMaxCables));
  }
  Measurement m;
  m.time_s = 0.5 * (log.time_s[range.begin] + log.time_s[range.end - 1]);
  m.kind = kind;
  for_each_sensor(
      [&](const Sensor& sensor, const LogMatrix& values, auto& reading) {
        const CableVector mean =
            column_means(values, range, sensor.columns_of(cable_count), sensor.is_angle(), true);
        if constexpr (std::is_same_v<decltype(reading), double&>) {
          reading = mean[0];
        } else {
          reading = mean;
        }
      },
      log, m);
  m.tension_setpoint_N = column_means(log.tension_setpoint_N, range, cable_count, false);
  m.samples = static_cast<int>(range.size());
  return m;
}

Log log_of(const std::vector<Measurement>& measurements) {
  const auto rows = static_cast<Eigen::Index>(measurements.size());
  Log log;
  log.time_s.setLinSpaced(rows, 0.0, static_cast<double>(rows - 1));
  const auto set = [&](LogMatrix& to, Eigen::Index row, std::span<const double> from) {
    if (row == 0) to.setConstant(rows, static_cast<Eigen::Index>(from.size()), kNaN);
    for (Eigen::Index c = 0; c < to.cols(); ++c) to(row, c) = from[static_cast<std::size_t>(c)];
  };
  for (Eigen::Index row = 0; row < rows; ++row) {
    const Measurement& m = measurements[static_cast<std::size_t>(row)];
    for_each_sensor(
        [&](const Sensor&, LogMatrix& to, const auto& reading) { set(to, row, numbers(reading)); },
        log, m);
    set(log.tension_setpoint_N, row, numbers(m.tension_setpoint_N));
  }
  for (LogMatrix* readings : log.groups()) {
    if (!readings->array().isFinite().any()) readings->resize(rows, 0);
  }
  return log;
}

void take_readings(const Log& log, std::vector<Measurement>& measurements) {
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    measurements[i].balanced_tension_N.resize(0);
    for_each_sensor(
        [&](const Sensor&, const LogMatrix& from, auto& reading) {
          const auto to = numbers(reading);
          for (Eigen::Index c = 0; c < from.cols(); ++c) {
            to[static_cast<std::size_t>(c)] = from(static_cast<Eigen::Index>(i), c);
          }
        },
        log, measurements[i]);
  }
}

void add_path(const PathState& path, const Log& log, const SampleRange& range, double run_start_s,
              Measurement& measurement) {
  const int n = static_cast<int>(measurement.length_m.size());
  const auto known = [](const CableVector& values) -> CableVector {
    return values.unaryExpr([](double v) { return std::isfinite(v) ? v : 0.0; });
  };
  measurement.length_direction = known(column_means(path.length_direction, range, n, false));
  measurement.swivel_direction = known(column_means(path.swivel_direction, range, n, false));
  measurement.length_direction_error =
      known(column_means(path.length_direction_error, range, n, false));
  measurement.swivel_direction_error =
      known(column_means(path.swivel_direction_error, range, n, false));
  measurement.length_direction_open =
      known(column_means(path.length_direction_open, range, n, false));
  measurement.swivel_direction_open =
      known(column_means(path.swivel_direction_open, range, n, false));
  measurement.length_rate_m_s = known(column_means(path.length_rate_m_s, range, n, false));
  measurement.swivel_rate_rad_s = known(column_means(path.swivel_rate_rad_s, range, n, false));
  measurement.attitude_rate_rad_s = known(column_means(path.attitude_rate_rad_s, range, 3, false));
  // The middle of the interval: what depends on time is averaged over it as well.
  measurement.run_time_s =
      0.5 * (log.time_s[range.begin] + log.time_s[range.end - 1]) - run_start_s;
}

}  // namespace cdprcal
