#include "cdprcal/motion/middle_readings.hpp"

#include "cdprcal/decompositions.hpp"

namespace cdprcal {

Measurement middle_reading(const Log& log, const SampleRange& run, Eigen::Index row, double half_s,
                           int cable_count, CableVector& tension_rate_N_s) {
  const auto within = [&](Eigen::Index other) {
    return std::abs(log.time_s[other] - log.time_s[row]) <= half_s + 1e-9;
  };
  Eigen::Index begin = row, end = row + 1;
  while (begin > run.begin && end < run.end && within(begin - 1) && within(end)) --begin, ++end;
  Measurement m = measurement_at(log, row, PoseKind::static_pose, cable_count);
  tension_rate_N_s.setZero(m.tension_N.size());
  constexpr Eigen::Index kLeast = 5;  // a parabola through fewer hardly smooths
  if (end - begin < kLeast) return m;
  const Eigen::VectorXd time_s = log.time_s.segment(begin, end - begin).array() - log.time_s[row];
  Eigen::MatrixXd powers(time_s.size(), 3);
  powers << Eigen::VectorXd::Ones(time_s.size()), time_s, time_s.cwiseAbs2();
  const Eigen::MatrixXd by_power = pseudo_inverse(powers);
  const Eigen::VectorXd weight = by_power.row(0).transpose();
  for_each_sensor(
      [&](const Sensor& sensor, const LogMatrix& values, auto& field) {
        const auto read = numbers(field);
        for (Eigen::Index c = 0; c < values.cols(); ++c) {
          double& at = read[static_cast<std::size_t>(c)];
          Eigen::VectorXd column = values.col(c).segment(begin, end - begin);
          if (sensor.is_angle()) {
            column = column.unaryExpr([&](double v) { return at + wrap_angle(v - at); });
          }
          if (!column.allFinite()) continue;
          at = weight.dot(column);
          if (&sensor == &row_of(Channel::balance).of())
            tension_rate_N_s[c] = by_power.row(1).dot(column);
        }
      },
      log, m);
  m.samples = std::max(1, static_cast<int>(1.0 / weight.squaredNorm()));
  return m;
}

}  // namespace cdprcal
