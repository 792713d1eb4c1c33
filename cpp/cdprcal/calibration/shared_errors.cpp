#include "cdprcal/calibration/shared_errors.hpp"

#include <algorithm>
#include <span>

#include "cdprcal/estimation/keep_one_of.hpp"

namespace cdprcal {

double moments_a_reading(const std::vector<PoseResidual>& residuals,
                         const std::vector<std::size_t>& moments) {
  constexpr double kGone = 0.05;
  std::vector<std::vector<double>> series;  // one a row, in the order of the moments
  for (const std::size_t i : moments) {
    std::size_t next = 0;
    const auto add = [&](std::span<const double> values) {
      for (const double value : values) {
        if (next == series.size()) series.emplace_back();
        series[next++].push_back(value);
      }
    };
    for_each_sensor([&](const Sensor&, const auto& field) { add(numbers(field)); }, residuals[i]);
    add(numbers(residuals[i].wrench));
  }
  const auto correlation = [&](std::size_t lag) {
    double all = 0.0, count = 0.0;
    for (const std::vector<double>& row : series) {
      double squares = 0.0, products = 0.0;
      for (std::size_t k = 0; k < row.size(); ++k) {
        if (std::isfinite(row[k])) squares += row[k] * row[k];
        if (k >= lag && std::isfinite(row[k] * row[k - lag])) products += row[k] * row[k - lag];
      }
      if (squares > 0.0) all += products / squares, count += 1.0;
    }
    return count > 0.0 ? all / count : 0.0;
  };
  double worth = 1.0;
  for (std::size_t lag = 1; lag < moments.size() / 3; ++lag) {
    const double rho = correlation(lag);
    if (rho < kGone) break;
    worth += 2.0 * rho;
  }
  return worth;
}

void leave_independent_moments(const CalibrateOptions& options, Calibration& calibration) {
  constexpr double kFewest = 8.0;  // moments that are left: fewer say nothing of their noise
  if (noise_source(options) != NoiseSource::from_data || !options.at_s.empty()) return;
  if (calibration.result.status != CalibrationStatus::converged) return;
  const auto& measurements = calibration.problem.measurements;
  const auto is_moment = [&](std::size_t i) {
    return i > 0 && measurements[i].kind == PoseKind::kinematic_pose;
  };
  std::vector<std::size_t> moments;
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    if (is_moment(i)) moments.push_back(i);
  }
  const double most = static_cast<double>(moments.size()) / kFewest;
  const double worth = moments_a_reading(calibration.result.residuals, moments);
  const auto every = static_cast<std::size_t>(std::round(std::min(worth, most)));
  if (every < 2) return;
  Calibration next = calibration;
  std::vector<Pose>& poses = next.result.poses;
  keep_one_of(every, is_moment, next.problem.measurements);
  keep_one_of(every, is_moment, poses);
  next.kinematic_poses -= static_cast<int>(measurements.size() - poses.size());
  const double solve_time_s = next.result.solve_time_s;
  next.result = solve(next.problem, poses, options.solve);
  next.result.solve_time_s += solve_time_s;
  refine_in_place(options, next);
  if (next.result.status == CalibrationStatus::converged) {
    calibration = std::move(next);
  } else if (calibration.result.covariance) {
    // Too few alone: all of them, and no more sure than as many as are independent.
    *calibration.result.covariance *= worth;
  }
}

}  // namespace cdprcal
