#include "cdprcal/readings/odd_readings.hpp"

#include <algorithm>
#include <cmath>

#include "cdprcal/statistics.hpp"

namespace cdprcal {

bool stands_out(double before, double value, double after, double least) {
  const double there = value - before, back = value - after;
  return there * back > 0.0 && std::min(std::abs(there), std::abs(back)) > least;
}

void leave_out_odd(std::vector<double>& at_rest) {
  constexpr std::size_t kMany = 8;
  constexpr double kOdd = 6.0, kNormal = 1.4826;  // σ over the median deviation
  if (at_rest.size() < kMany) return;
  const double middle = median(at_rest);
  std::vector<double> away = at_rest;
  for (double& v : away) v = std::abs(v - middle);
  const double least = kOdd * kNormal * median(std::move(away));
  if (!(least > 0.0)) return;
  const std::vector<double> all = at_rest;
  at_rest.clear();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool inner = i > 0 && i + 1 < all.size();
    if (!inner || !stands_out(all[i - 1], all[i], all[i + 1], least)) at_rest.push_back(all[i]);
  }
}

void leave_out_impossible(const Log& log, Eigen::Index row, double gravity_m_s2, double lever_m,
                          Measurement& m) {
  if (row < 1 || row + 1 >= log.sample_count()) return;
  const double step_s =
      std::max(log.time_s[row] - log.time_s[row - 1], log.time_s[row + 1] - log.time_s[row]);
  const double least_m = gravity_m_s2 * step_s * step_s;
  for_each_sensor(
      [&](const Sensor& sensor, const LogMatrix& values) {
        if (sensor.is_inertial() || &values == &log.tension_N) return;
        const std::span<double> readings = readings_of(m, sensor);
        const auto columns = std::min(values.cols(), static_cast<Eigen::Index>(readings.size()));
        for (Eigen::Index c = 0; c < columns; ++c) {
          const double value = values(row, c);
          double before = values(row - 1, c), after = values(row + 1, c);
          if (sensor.is_angle()) {
            before = value + wrap_angle(before - value);
            after = value + wrap_angle(after - value);
          }
          const double least = sensor.is_angle() ? least_m / lever_m : least_m;
          if (stands_out(before, value, after, least)) readings[static_cast<std::size_t>(c)] = kNaN;
        }
      },
      log);
}

}  // namespace cdprcal
