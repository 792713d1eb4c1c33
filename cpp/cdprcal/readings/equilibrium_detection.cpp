#include "cdprcal/readings/equilibrium_detection.hpp"

#include <algorithm>
#include <limits>

#include "cdprcal/error.hpp"
#include "cdprcal/readings/fresh.hpp"
#include "cdprcal/readings/rest_list.hpp"
#include "cdprcal/readings/signal.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal {
namespace {

/// Prefix sums of one column over finite samples: any window's mean and scatter in O(1).
class Trace {
 public:
  /// `fresh`: the readings among `values`, which may hold each over several rows, or leave those
  /// rows empty.
  Trace(const Eigen::VectorXd& values, const Eigen::VectorXd& fresh, double tolerance,
        Channel channel)
      : noise_(channel_noise(fresh)), tolerance_(tolerance), channel_(channel) {
    const Eigen::Index n = values.size();
    const auto readings = static_cast<double>(fresh.array().isFinite().count());
    held_ = worth_ =
        static_cast<double>(values.array().isFinite().count()) / std::max(1.0, readings);
    rows_ = static_cast<double>(n) / std::max(1.0, readings);
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

  /// A filter hides the noise from second differences, and what is at the edge of a step scatters
  /// by up to q²/4, not q²/12 as readings do in the mean.
  void take(const Signals& signals) {
    const Signal& signal = signals[static_cast<std::size_t>(channel_)];
    if (signal.correlation_s == 0.0 && signal.resolution == 0.0) return;
    noise_ = std::max(noise_, std::hypot(signal.sigma, signal.resolution / std::sqrt(6.0)));
    worth_ = held_ * signal.rows / signal.hold_rows;
  }

  /// Of the log, from one reading to the next.
  [[nodiscard]] double rows() const { return rows_; }

  /// Scatter over what noise and tolerance make of it.
  [[nodiscard]] double restlessness(const SampleRange& w) const {
    return moments(w).variance / (noise_ * noise_ + tolerance_ * tolerance_ + 1e-300);
  }

  /// Scatter within the window is noise, or too small to matter.
  [[nodiscard]] bool scatter_is_noise(const SampleRange& w, double confidence) const {
    const auto [count, mean, variance] = moments(w);
    if (count * worth_ < kTelling * held_) return true;
    // Over less than a filter remembers, noise scatters less than it does on the whole.
    const double freedom = std::max(1.0, count - 1.0);
    const double noise_limit = noise_ * noise_ * chi_square_quantile(confidence, freedom) / freedom;
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
  static constexpr double kTelling = 3.0;  ///< so few readings say something of their scatter

  struct Moments {
    double count, mean, variance;  ///< count: of independent readings
  };
  [[nodiscard]] Moments moments(const SampleRange& w) const {
    const Eigen::RowVector3d s = sums_.row(w.end) - sums_.row(w.begin);
    if (s[0] < 1.0) return {0.0, 0.0, 0.0};
    const double mean = s[1] / s[0];
    const double squares = std::max(0.0, s[2] - s[0] * mean * mean);
    const double variance = s[0] > held_ ? squares / std::max(s[0] - worth_, 0.5 * s[0]) : 0.0;
    return {s[0] / worth_, mean, variance};
  }

  double noise_;
  double rows_;   ///< of the log, a reading
  double held_;   ///< rows that have one value, of those that are not empty
  double worth_;  ///< the same, worth one independent reading
  double tolerance_;
  Channel channel_;
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> sums_;
};

/// Windows of the time axis: so long, or up to twice that where it takes so long to read what is
/// read most often a few times.
class Windows {
 public:
  Windows(const Eigen::VectorXd& time, const std::vector<Trace>& geometry, double window_s)
      : time_(time), window_s_(window_s) {
    constexpr double kFewest = 4.0;
    double rows = std::numeric_limits<double>::infinity();
    for (const Trace& c : geometry) rows = std::min(rows, c.rows());
    least_ = static_cast<Eigen::Index>(std::ceil(kFewest * rows));
  }
  /// The last row of the window that begins there, no earlier than `from`; the log's end if none.
  [[nodiscard]] Eigen::Index last_of(Eigen::Index begin, Eigen::Index from) const {
    Eigen::Index last = std::max(from, begin + least_ - 1);
    while (last < time_.size() && time_[last] - time_[begin] < window_s_ - 1e-9) ++last;
    return std::min(last, time_.size());
  }
  /// Whether it is short enough to show a rest.
  [[nodiscard]] bool shows(const SampleRange& window) const {
    return time_[window.end - 1] - time_[window.begin] < 2.0 * window_s_;
  }

 private:
  const Eigen::VectorXd& time_;
  double window_s_;
  Eigen::Index least_ = 1;
};

/// The quietest quarter of a run, before any rest is known.
std::vector<SampleRange> quietest(const std::vector<Trace>& geometry, const Eigen::VectorXd& time,
                                  const Windows& all) {
  constexpr std::size_t kStretch = 4;  // windows that show what a filter remembers
  constexpr double kAsCalm = 2.0;      // times the restlessness of single windows
  std::vector<SampleRange> windows;
  std::vector<double> restless;
  for (Eigen::Index begin = 0, end = 0; begin < time.size(); begin = end) {
    end = all.last_of(begin, begin);
    double worst = 0.0;
    for (const Trace& c : geometry) worst = std::max(worst, c.restlessness({begin, end}));
    if (end >= time.size()) continue;
    windows.push_back({begin, end});
    restless.push_back(worst);
  }
  const std::size_t quarter = (windows.size() + 3) / 4;
  // A quarter, in stretches of so many windows; and how restless the worst of them is.
  const auto in_stretches = [&](std::size_t length) {
    std::vector<std::pair<double, std::size_t>> stretches;
    for (std::size_t k = 0; k + length <= windows.size(); ++k) {
      const auto first = restless.begin() + static_cast<std::ptrdiff_t>(k);
      stretches.push_back(
          {*std::max_element(first, first + static_cast<std::ptrdiff_t>(length)), k});
    }
    std::ranges::sort(stretches);
    std::pair<double, std::vector<bool>> out{std::numeric_limits<double>::infinity(),
                                             std::vector<bool>(windows.size(), false)};
    std::size_t left = quarter;
    for (const auto& [worst, first] : stretches) {
      if (left == 0) break;
      out.first = worst;
      for (std::size_t k = first; k < first + length && left > 0; ++k) {
        if (!out.second[k]) --left;
        out.second[k] = true;
      }
    }
    return out;
  };
  auto [worst, chosen] = in_stretches(1);
  if (auto longer = in_stretches(kStretch); longer.first <= kAsCalm * worst) {
    chosen = std::move(longer.second);
  }
  std::vector<SampleRange> out;
  for (std::size_t k = 0; k < windows.size(); ++k) {
    if (!chosen[k]) continue;
    if (k > 0 && chosen[k - 1]) {
      out.back().end = windows[k].end;
    } else {
      out.push_back(windows[k]);
    }
  }
  return out;
}

/// Those that are numbers.
Eigen::VectorXd finite_of(const Eigen::Ref<const Eigen::VectorXd>& values) {
  Eigen::VectorXd out(values.size());
  out.conservativeResize(std::copy_if(values.begin(), values.end(), out.begin(),
                                      [](double v) { return std::isfinite(v); }) -
                         out.begin());
  return out;
}

void require_usable(const DetectionOptions& options) {
  if (!(options.window_s > 0.0 && std::isfinite(options.window_s))) {
    throw InputError("window_s: must be a positive number of seconds");
  }
  if (!(options.confidence > 0.0 && options.confidence < 1.0)) {
    throw InputError("confidence: must be between 0 and 1");
  }
  if (!(options.tolerance >= 0.0 && std::isfinite(options.tolerance))) {
    throw InputError("tolerance: must be a number of sigma, 0 or more");
  }
}

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
  const Eigen::VectorXd read = finite_of(given);
  const Eigen::VectorXd values = angles ? unwrapped(read) : read;
  std::vector<double> seconds;
  double resolution = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = 2; i < values.size(); ++i) {
    const double d = values[i] - 2.0 * values[i - 1] + values[i - 2];
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
  require_usable(options);
  const Eigen::Index count = range.size();
  std::vector<Equilibrium> found;
  if (is_rest_list(log)) {
    for (Eigen::Index row = range.begin; row < range.end; ++row) {
      found.push_back({{row, row + 1}, log.time_s[row], log.time_s[row]});
    }
    return found;
  }
  if (count < 4) return found;

  std::vector<Trace> geometry, tensions;
  for_each_sensor(
      [&](const Sensor& sensor, const LogMatrix& values) {
        if (sensor.is_inertial()) return;  // a platform hums while it rests
        auto& group = &values == &log.tension_N ? tensions : geometry;
        const FreshRows fresh = fresh_rows(values, range);
        std::vector<Eigen::Index> rows = fresh.rows;  // of the range
        for (Eigen::Index& row : rows) row -= range.begin;
        for (const ChannelRow& row : channels_of(sensor)) {
          const Eigen::Index end = std::min<Eigen::Index>(row.first + row.count, values.cols());
          for (Eigen::Index c = row.first; c < end; ++c) {
            Eigen::VectorXd column = values.col(c).segment(range.begin, count);
            if (!column.array().isFinite().any()) continue;
            if (sensor.is_angle()) column = unwrapped(std::move(column));
            group.emplace_back(column, column(rows), options.tolerance * (sigma.*sensor.sigma),
                               channel_of(row));
          }
        }
      },
      log);
  if (geometry.empty()) {
    throw InputError(
        log.source +
        ": no lengths, swivels or attitude to tell rest from motion by; log one of them");
  }

  const Eigen::VectorXd time = log.time_s.segment(range.begin, count);
  const Windows windows(time, geometry, options.window_s);
  std::vector<SampleRange> calm = quietest(geometry, time, windows);
  for (SampleRange& stretch : calm) stretch.begin += range.begin, stretch.end += range.begin;
  const Signals how = signals_within(log, range, calm, sigma);
  for (std::vector<Trace>* group : {&geometry, &tensions}) {
    for (Trace& series : *group) series.take(how);
  }

  // Mark every sample of every window that passes all tests.
  const double z = normal_quantile(0.5 + 0.5 * options.confidence);
  std::vector<char> rests(static_cast<std::size_t>(count), 0);
  Eigen::Index last = 0;
  for (Eigen::Index begin = 0; begin < count; ++begin) {
    last = windows.last_of(begin, last);
    if (last >= count) break;
    const SampleRange window{begin, last + 1};
    if (!windows.shows(window)) continue;
    const bool at_rest = std::all_of(geometry.begin(), geometry.end(),
                                     [&](const Trace& c) {
                                       return c.scatter_is_noise(window, options.confidence);
                                     }) &&
                         std::all_of(tensions.begin(), tensions.end(),
                                     [&](const Trace& c) { return c.halves_agree(window, z); });
    if (at_rest) std::fill(rests.begin() + begin, rests.begin() + last + 1, 1);
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
                                   [&](const Trace& c) { return c.same_place(runs.back(), run); });
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
