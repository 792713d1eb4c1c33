#include "cdprcal/readings/still.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "cdprcal/readings/equilibrium_detection.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal {
namespace {

/// Sums of one channel since the start, and how its readings come.
struct Running {
  std::vector<double> sum{0.0}, count{0.0};
  Signal signal;
};

/// The tests below suppose Gaussian noise: the tail of a distribution counts as no farther from the
/// median of those around it than that goes, and a spike says nothing. In a motion all are far.
void clip_tails(double sigma, Eigen::VectorXd& values) {
  constexpr double kTail = 3.0, kSpike = 2.0;  // σ, tails
  constexpr Eigen::Index kBeside = 3;
  const Eigen::VectorXd given = values;
  std::vector<double> around, off;
  for (Eigen::Index i = 0; i < given.size(); ++i) {
    around.clear(), off.clear();
    for (Eigen::Index j = std::max<Eigen::Index>(0, i - kBeside);
         j < std::min(given.size(), i + kBeside + 1); ++j) {
      if (std::isfinite(given[j])) around.push_back(given[j]);
    }
    if (!std::isfinite(given[i]) || around.size() <= kBeside) continue;
    const double middle = median(around);
    for (const double value : around) off.push_back(std::abs(value - middle));
    const double most = kTail * std::max(sigma, median(off));
    const bool is_spike = std::abs(given[i] - middle) > kSpike * most;
    values[i] = is_spike ? kNaN : std::clamp(given[i], middle - most, middle + most);
  }
}

/// Lengths show a slow motion at rest best, and it looks like the noise of a longer filter there:
/// theirs is no longer than any other's, where others have one. By the same differences from one
/// reading to the next, which a first-order filter makes (1 − c)(3 − c)/3 of the variance.
Signals without_motion(Signals signals) {
  Signal& length = signals[static_cast<std::size_t>(Channel::length)];
  double longest_s = 0.0;
  for (const Signal& other : signals) {
    if (&other != &length) longest_s = std::max(longest_s, other.correlation_s);
  }
  if (!(longest_s > 0.0) || !(length.correlation_s > longest_s)) return signals;
  const auto differences = [](double c) { return (1.0 - c) * (3.0 - c); };
  const auto worth = [](double c) { return (1.0 + c) / (1.0 - c); };
  const double looks = std::exp(-length.period_s / length.correlation_s);
  const double is = std::exp(-length.period_s / longest_s);
  length.sigma *= std::sqrt(differences(looks) / differences(is));
  length.rows *= worth(is) / worth(looks);
  length.correlation_s = longest_s;
  return signals;
}

/// Of a column of a log, whose noise few samples would hardly tell.
Running running(const Eigen::VectorXd& column, const SampleRange& range, bool angle,
                const Signal& channel) {
  Running out;
  Eigen::VectorXd values = column.segment(range.begin, range.size());
  if (angle) values = unwrapped(values);
  out.signal = of_column(channel, channel_noise(column, angle));
  if (out.signal.sigma > 0.0) clip_tails(out.signal.sigma, values);
  double origin = kNaN;
  for (const double v : values) {
    const bool there = std::isfinite(v);
    if (there && std::isnan(origin)) origin = v;
    out.sum.push_back(out.sum.back() + (there ? v - origin : 0.0));
    out.count.push_back(out.count.back() + (there ? 1.0 : 0.0));
  }
  return out;
}

/// Whether the means of so many parts of equal length agree in all channels together. `time_s`: of
/// the samples, since the run's first.
bool parts_agree(const std::vector<Running>& channels, const std::vector<double>& time_s,
                 std::size_t end, std::size_t parts) {
  // To call a start a motion by its first samples alone takes more than to shorten a rest.
  const double confidence = end > 2 * kFewestStill ? 0.99 : 0.999;
  double chi_square = 0.0;
  int freedom = 0;
  for (const Running& c : channels) {
    if (!(c.signal.sigma > 0.0)) continue;
    double weight = 0.0, mean = 0.0, squares = 0.0;  // West's update: of the parts' means
    int told = 0;
    for (std::size_t part = 0; part < parts; ++part) {
      const std::size_t from = end * part / parts, until = end * (part + 1) / parts;
      const double count = c.count[until] - c.count[from];
      if (count < 1.0) continue;
      const double middle_s = 0.5 * (time_s[from] + time_s[until - 1]);
      const double own = 1.0 / c.signal.variance(count, middle_s);
      const double away = (c.sum[until] - c.sum[from]) / count - mean;
      weight += own;
      mean += away * own / weight;
      squares += own * away * (away - away * own / weight);
      ++told;
    }
    chi_square += squares;
    freedom += std::max(0, told - 1);
  }
  return freedom == 0 || chi_square <= chi_square_quantile(confidence, freedom);
}

/// Whether the first samples agree with all others. A filter that begins at its first reading says
/// nothing.
bool first_agree(const std::vector<Running>& channels, std::size_t end, std::size_t first) {
  constexpr double kConfidence = 0.999;
  double chi_square = 0.0, largest = 0.0;
  int freedom = 0;
  for (const Running& c : channels) {
    const double before = c.count[first], after = c.count[end] - before;
    if (!(c.signal.sigma > 0.0) || c.signal.correlation_s > 0.0) continue;
    if (before < 1.0 || after < 1.0) continue;
    const double change = c.sum[first] / before - (c.sum[end] - c.sum[first]) / after;
    const double square = change * change / (c.signal.variance(before) + c.signal.variance(after));
    chi_square += square;
    largest = std::max(largest, square);
    ++freedom;
  }
  if (first == 1 && freedom > 1) {  // a motion shows in several readings: one may be odd
    chi_square -= largest;
    --freedom;
  }
  return freedom == 0 || chi_square <= chi_square_quantile(kConfidence, freedom);
}

/// A drift shows in halves; what goes there and comes back, in smaller parts; a motion that ends,
/// in the first samples.
bool is_still(const std::vector<Running>& channels, const std::vector<double>& time_s,
              std::size_t end) {
  return std::ranges::all_of(std::array{2, 4, 8},
                             [&](std::size_t parts) {
                               return parts > end || parts_agree(channels, time_s, end, parts);
                             }) &&
         std::ranges::all_of(std::array{1, 2, 4}, [&](std::size_t first) {
           return first >= end || first_agree(channels, end, first);
         });
}

}  // namespace

SampleRange still_since_start(const Log& log, const SampleRange& range, const Signals& given,
                              double begun_s) {
  const Signals signals = without_motion(given);
  std::vector<Running> channels;
  for_each_sensor(
      [&](const Sensor& sensor, const LogMatrix& group) {
        if (sensor.is_inertial()) return;  // a platform hums while it is still
        for (const ChannelRow& row : channels_of(sensor)) {
          const Signal& signal = signals[static_cast<std::size_t>(channel_of(row))];
          const Eigen::Index end = std::min<Eigen::Index>(row.first + row.count, group.cols());
          for (Eigen::Index c = row.first; c < end; ++c) {
            channels.push_back(running(group.col(c), range, sensor.is_angle(), signal));
          }
        }
      },
      log);
  std::vector<double> time_s;
  for (Eigen::Index i = range.begin; i < range.end; ++i) {
    time_s.push_back(begun_s + log.time_s[i] - log.time_s[range.begin]);
  }
  Eigen::Index size = range.size();
  while (size > 1 && !is_still(channels, time_s, static_cast<std::size_t>(size))) {
    size = std::min(size - 1, size * 9 / 10);
  }
  return {range.begin, range.begin + size};
}

SampleRange at_the_start(const Log& log, const SampleRange& range, const Signals& signals,
                         double begun_s) {
  SampleRange out = still_since_start(log, range, signals, begun_s);
  if (out.end < range.end) {
    out.end = out.begin + std::max(out.size() / 2, std::min(out.size(), kFewestStill));
  }
  return out;
}

}  // namespace cdprcal
