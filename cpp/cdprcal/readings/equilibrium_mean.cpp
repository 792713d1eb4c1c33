#include "cdprcal/readings/equilibrium_mean.hpp"

#include <algorithm>

#include "cdprcal/error.hpp"
#include "cdprcal/readings/equilibrium_detection.hpp"
#include "cdprcal/readings/log_checks.hpp"

namespace cdprcal {
namespace {

/// Readings of all channels [samples, c], angles unwrapped.
Eigen::MatrixXd readings(const Log& log, const SampleRange& samples) {
  const Eigen::Index rows = samples.size();
  Eigen::MatrixXd values(rows, 0);
  for_each_sensor(
      [&](const Sensor& sensor, const LogMatrix& group) {
        for (Eigen::Index c = 0; c < group.cols(); ++c) {
          Eigen::VectorXd column = group.col(c).segment(samples.begin, rows);
          if (sensor.is_angle()) column = unwrapped(std::move(column));
          values.conservativeResize(rows, values.cols() + 1);
          values.col(values.cols() - 1) = column;
        }
      },
      log);
  return values;
}

/// N / (1 + 2 Σ ρₖ) of deviations from their mean (finite ones); between 1 and N.
double effective_count(const std::vector<double>& deviation) {
  const auto n = deviation.size();
  const auto count = static_cast<double>(n);
  const auto covariance = [&](std::size_t lag) {
    double sum = 0.0;
    for (std::size_t i = lag; i < n; ++i) sum += deviation[i] * deviation[i - lag];
    return sum / count;
  };
  const double variance = covariance(0);
  if (n < 3 || !(variance > 0.0)) return count;
  // Sums of neighbouring lags are positive for a stationary series; the first that is not is noise.
  double time = -1.0;
  for (std::size_t lag = 0; lag + 1 < n; lag += 2) {
    const double pair = (covariance(lag) + covariance(lag + 1)) / variance;
    if (pair <= 0.0) break;
    time += 2.0 * pair;
  }
  return std::clamp(count / std::max(time, 1e-300), 1.0, count);
}

}  // namespace

EquilibriumMean equilibrium_mean(const Log& log, const SampleRange& samples) {
  require_samples(samples, log);
  const Eigen::MatrixXd values = readings(log, samples);
  const Eigen::Index channels = values.cols();
  EquilibriumMean out;
  out.mean = Eigen::VectorXd::Constant(channels, kNaN);
  out.effective_samples = Eigen::VectorXd::Zero(channels);
  out.covariance = Eigen::MatrixXd::Constant(channels, channels, kNaN);
  for (Eigen::Index c = 0; c < channels; ++c) {
    std::vector<double> there;
    for (const double v : values.col(c)) {
      if (std::isfinite(v)) there.push_back(v);
    }
    if (there.empty()) continue;
    // About the first, so that the digits stay.
    double sum = 0.0;
    for (const double v : there) sum += v - there.front();
    out.mean[c] = there.front() + sum / static_cast<double>(there.size());
    for (double& v : there) v -= out.mean[c];
    out.effective_samples[c] = effective_count(there);
  }
  for (Eigen::Index a = 0; a < channels; ++a) {
    for (Eigen::Index b = a; b < channels; ++b) {
      if (std::isnan(out.mean[a]) || std::isnan(out.mean[b])) continue;
      double sum = 0.0;
      Eigen::Index count = 0;
      for (Eigen::Index i = 0; i < values.rows(); ++i) {
        const double product = (values(i, a) - out.mean[a]) * (values(i, b) - out.mean[b]);
        if (!std::isfinite(product)) continue;
        sum += product;
        ++count;
      }
      // The mean itself takes one independent reading's worth of scatter away.
      const double worth = std::sqrt(out.effective_samples[a] * out.effective_samples[b]);
      out.covariance(a, b) = out.covariance(b, a) =
          count > 1 ? sum / static_cast<double>(count) / std::max(worth - 1.0, 1.0) : 0.0;
    }
  }
  return out;
}

}  // namespace cdprcal
