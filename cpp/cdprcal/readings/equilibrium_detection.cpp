#include "cdprcal/readings/equilibrium_detection.hpp"

#include <algorithm>

#include "cdprcal/error.hpp"
#include "cdprcal/readings/fresh.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal {
namespace {

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Prefix sums of one column over finite samples: any window's mean and scatter in O(1).
class Series {
 public:
  /// `fresh`: the readings that `values` repeats for so many rows.
  Series(const Eigen::VectorXd& values, const Eigen::VectorXd& fresh, double hold_rows,
         double tolerance)
      : noise_(channel_noise(fresh)), hold_rows_(hold_rows), tolerance_(tolerance) {
    const Eigen::Index n = values.size();
    // About the first finite value, so that squares keep their digits.
    double origin = 0.0;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (std::isfinite(values[i])) {
        origin = values[i];
        break;
      }
    }
    sums_.setZero(n + 1, 3);
    for (Eigen::Index i = 0; i < n; ++i) {
      const bool present = std::isfinite(values[i]);
      const double v = present ? values[i] - origin : 0.0;
      sums_.row(i + 1) = sums_.row(i) + Eigen::RowVector3d(present ? 1.0 : 0.0, v, v * v);
    }
  }

  /// Scatter within the window is noise, or too small to matter.
  [[nodiscard]] bool scatter_is_noise(const SampleRange& w, double confidence) const {
    const auto [count, mean, variance] = moments(w);
    if (count < 3.0) return true;
    const double noise_limit =
        noise_ * noise_ * chi_square_quantile(confidence, count - 1.0) / (count - 1.0);
    return variance <= noise_limit + tolerance_ * tolerance_;
  }

  /// The two halves of the window have one mean, or differ too little to matter.
  [[nodiscard]] bool halves_agree(const SampleRange& w, double z) const {
    const Eigen::Index middle = w.begin + w.size() / 2;
    const auto [count_a, mean_a, variance_a] = moments({w.begin, middle});
    const auto [count_b, mean_b, variance_b] = moments({middle, w.end});
    if (count_a < 2.0 || count_b < 2.0) return true;
    const double error = std::sqrt(std::max(variance_a, noise_ * noise_) / count_a +
                                   std::max(variance_b, noise_ * noise_) / count_b);
    return std::abs(mean_a - mean_b) <= z * error + 2.0 * tolerance_;
  }

  /// Mean over one range differs from that over another by less than noise and tolerance allow.
  [[nodiscard]] bool same_place(const SampleRange& a, const SampleRange& b) const {
    const auto [count_a, mean_a, variance_a] = moments(a);
    const auto [count_b, mean_b, variance_b] = moments(b);
    if (count_a < 1.0 || count_b < 1.0) return true;
    return std::abs(mean_a - mean_b) <= 4.0 * (tolerance_ + noise_);
  }

 private:
  struct Moments {
    double count, mean, variance;  ///< count: of fresh readings
  };
  [[nodiscard]] Moments moments(const SampleRange& w) const {
    const Eigen::RowVector3d s = sums_.row(w.end) - sums_.row(w.begin);
    if (s[0] < 1.0) return {0.0, 0.0, 0.0};
    const double mean = s[1] / s[0];
    const double variance =
        s[0] > hold_rows_ ? std::max(0.0, s[2] - s[0] * mean * mean) / (s[0] - hold_rows_) : 0.0;
    return {s[0] / hold_rows_, mean, variance};
  }

  double noise_;
  double hold_rows_;
  double tolerance_;
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> sums_;
};

}  // namespace

Eigen::VectorXd unwrapped(Eigen::VectorXd angles) {
  double previous = kNaN;
  for (Eigen::Index i = 0; i < angles.size(); ++i) {
    if (!std::isfinite(angles[i])) continue;
    if (std::isfinite(previous)) angles[i] = previous + wrap_angle(angles[i] - previous);
    previous = angles[i];
  }
  return angles;
}

double channel_noise(const Eigen::Ref<const Eigen::VectorXd>& given, bool angles) {
  const Eigen::VectorXd values = angles ? unwrapped(given) : Eigen::VectorXd(given);
  std::vector<double> seconds;
  double resolution = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 2; i < values.size(); ++i) {
    const double d = values[i] - 2.0 * values[i - 1] + values[i - 2];
    if (!std::isfinite(d)) continue;
    seconds.push_back(std::abs(d));
    // Steps of a few ulps are arithmetic, not resolution.
    const double step = std::abs(values[i] - values[i - 1]);
    if (step > 1e-12 * (1.0 + std::abs(values[i]))) resolution = std::min(resolution, step);
  }
  if (seconds.empty()) return 0.0;
  // Var(second difference) = 6 σ²; 1.4826 turns a median of |normal| into σ.
  const double noise = 1.4826 * median(seconds) / std::sqrt(6.0);
  return std::isfinite(resolution) ? std::max(noise, resolution / std::sqrt(12.0)) : noise;
}

std::vector<Equilibrium> detect_equilibria(const Log& log, const SampleRange& range,
                                           const SensorSigma& sigma,
                                           const DetectionOptions& options) {
  const Eigen::Index count = range.size();
  std::vector<Equilibrium> found;
  if (count < 4) return found;

  std::vector<Series> geometry, tensions;
  for_each_sensor(
      [&](const Sensor& sensor, const LogMatrix& values) {
        auto& group = &values == &log.tension_N ? tensions : geometry;
        const FreshRows fresh = fresh_rows(values, range);
        std::vector<Eigen::Index> rows = fresh.rows;  // of the range
        for (Eigen::Index& row : rows) row -= range.begin;
        for (Eigen::Index c = 0; c < values.cols(); ++c) {
          Eigen::VectorXd column = values.col(c).segment(range.begin, count);
          if (!column.array().isFinite().any()) continue;
          if (sensor.is_angle()) column = unwrapped(std::move(column));
          group.emplace_back(column, column(rows), fresh.hold_rows,
                             options.tolerance * (sigma.*sensor.sigma));
        }
      },
      log);
  if (geometry.empty()) {
    throw InputError(
        log.source +
        ": no lengths, swivels or attitude to tell rest from motion by; log one of them");
  }

  // Mark every sample of every window that passes all tests.
  const Eigen::VectorXd time = log.time_s.segment(range.begin, count);
  const double z = normal_quantile(0.5 + 0.5 * options.confidence);
  std::vector<char> rests(static_cast<std::size_t>(count), 0);
  Eigen::Index end = 0;
  for (Eigen::Index begin = 0; begin < count; ++begin) {
    while (end < count && time[end] - time[begin] < options.window_s - 1e-9) ++end;
    if (end >= count) break;
    const SampleRange window{begin, end + 1};
    if (window.size() < 4) continue;
    const bool at_rest = std::all_of(geometry.begin(), geometry.end(),
                                     [&](const Series& c) {
                                       return c.scatter_is_noise(window, options.confidence);
                                     }) &&
                         std::all_of(tensions.begin(), tensions.end(),
                                     [&](const Series& c) { return c.halves_agree(window, z); });
    if (at_rest) std::fill(rests.begin() + begin, rests.begin() + end + 1, 1);
  }

  // Runs of such samples; two with a short disturbance between them at one place are one rest.
  std::vector<SampleRange> runs;
  for (Eigen::Index i = 0; i < count;) {
    if (!rests[static_cast<std::size_t>(i)]) {
      ++i;
      continue;
    }
    Eigen::Index stop = i;
    while (stop < count && rests[static_cast<std::size_t>(stop)]) ++stop;
    const SampleRange run{i, stop};
    const bool joins = !runs.empty() &&
                       time[run.begin] - time[runs.back().end - 1] <= 2.0 * options.window_s &&
                       std::all_of(geometry.begin(), geometry.end(),
                                   [&](const Series& c) { return c.same_place(runs.back(), run); });
    if (joins) {
      runs.back().end = run.end;
    } else {
      runs.push_back(run);
    }
    i = stop;
  }
  for (const SampleRange& run : runs) {
    found.push_back(
        {{range.begin + run.begin, range.begin + run.end}, time[run.begin], time[run.end - 1]});
  }
  return found;
}

SampleRange inner_part(const Log& log, const SampleRange& run, const Equilibrium& rest,
                       double window_s) {
  SampleRange out = rest.samples;
  const Eigen::Index most = rest.samples.size() / 4;
  const double begin_s = log.time_s[rest.samples.begin] + 0.5 * window_s;
  const double end_s = log.time_s[rest.samples.end - 1] - 0.5 * window_s;
  if (rest.samples.begin > run.begin) {
    while (out.begin < rest.samples.begin + most && log.time_s[out.begin] < begin_s) ++out.begin;
  }
  if (rest.samples.end < run.end) {
    while (out.end > rest.samples.end - most && log.time_s[out.end - 1] > end_s) --out.end;
  }
  return out;
}

}  // namespace cdprcal
