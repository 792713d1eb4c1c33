#include "cdprcal/readings/measurement.hpp"

namespace cdprcal {
namespace {

/// Mean of the finite entries of each column over the rows of `range`; NaN without any.
/// `angles`: taken about the first finite entry, so that a wrap between samples does no harm.
CableVector column_means(const LogMatrix& values, const SampleRange& range, int columns,
                         bool angles) {
  CableVector mean = CableVector::Constant(columns, kNaN);
  for (Eigen::Index c = 0; c < std::min<Eigen::Index>(columns, values.cols()); ++c) {
    double first = kNaN, sum = 0.0;
    int count = 0;
    for (Eigen::Index row = range.begin; row < range.end; ++row) {
      const double value = values(row, c);
      if (!std::isfinite(value)) continue;
      if (count == 0) first = value;
      sum += angles ? wrap_angle(value - first) : value - first;
      ++count;
    }
    if (count > 0) mean[c] = first + sum / count;
  }
  return mean;
}

}  // namespace

Measurement measurement_at(const Log& log, Eigen::Index index, PoseKind kind, int cable_count) {
  Measurement m = measurement_mean(log, {index, index + 1}, kind, cable_count);
  m.time_s = log.time_s[index];
  return m;
}

Measurement measurement_mean(const Log& log, const SampleRange& range, PoseKind kind,
                             int cable_count) {
  Measurement m;
  m.time_s = 0.5 * (log.time_s[range.begin] + log.time_s[range.end - 1]);
  m.kind = kind;
  m.length_m = column_means(log.length_m, range, cable_count, false);
  m.swivel_rad = column_means(log.swivel_rad, range, cable_count, true);
  m.tension_N = column_means(log.tension_N, range, cable_count, false);
  m.roll_pitch_yaw_rad = column_means(log.roll_pitch_yaw_rad, range, 3, true);
  m.tension_setpoint_N = column_means(log.tension_setpoint_N, range, cable_count, false);
  m.absolute_yaw_rad = column_means(log.absolute_yaw_rad, range, 1, true)[0];
  m.direct_length_m = column_means(log.direct_length_m, range, cable_count, false);
  m.position_m = column_means(log.position_m, range, 3, false);
  m.samples = static_cast<int>(range.size());
  return m;
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
  measurement.attitude_rate_rad_s = known(column_means(path.attitude_rate_rad_s, range, 3, false));
  // The middle of the interval: what depends on time is averaged over it as well.
  measurement.run_time_s =
      0.5 * (log.time_s[range.begin] + log.time_s[range.end - 1]) - run_start_s;
}

}  // namespace cdprcal
