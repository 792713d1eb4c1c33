#include "cdprcal/readings/still.hpp"

#include <algorithm>
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

Running running(const Eigen::VectorXd& given, bool angle, const Signal& channel) {
  Running out;
  const Eigen::VectorXd values = angle ? unwrapped(given) : given;
  out.signal = of_column(channel, channel_noise(values));
  double origin = kNaN;
  for (const double v : values) {
    const bool there = std::isfinite(v);
    if (there && std::isnan(origin)) origin = v;
    out.sum.push_back(out.sum.back() + (there ? v - origin : 0.0));
    out.count.push_back(out.count.back() + (there ? 1.0 : 0.0));
  }
  return out;
}

bool halves_agree(const std::vector<Running>& channels, std::size_t end) {
  constexpr double kConfidence = 0.95;
  const std::size_t middle = end / 2;
  double chi_square = 0.0;
  int freedom = 0;
  for (const Running& c : channels) {
    const double first = c.count[middle], second = c.count[end] - first;
    if (first < 1.0 || second < 1.0 || !(c.signal.sigma > 0.0)) continue;
    const double change = (c.sum[end] - c.sum[middle]) / second - c.sum[middle] / first;
    chi_square += change * change / (c.signal.variance(first) + c.signal.variance(second));
    ++freedom;
  }
  return freedom == 0 || chi_square <= chi_square_quantile(kConfidence, freedom);
}

}  // namespace

SampleRange still_since_start(const Log& log, const SampleRange& range, const Signals& signals,
                              Eigen::Index least) {
  std::vector<Running> channels;
  for_each_sensor(
      [&](const Sensor& sensor, const LogMatrix& group) {
        for (const ChannelRow& row : channels_of(sensor)) {
          const Signal& signal = signals[static_cast<std::size_t>(channel_of(row))];
          const Eigen::Index end = std::min<Eigen::Index>(row.first + row.count, group.cols());
          for (Eigen::Index c = row.first; c < end; ++c) {
            channels.push_back(running(group.col(c).segment(range.begin, range.size()),
                                       sensor.is_angle(), signal));
          }
        }
      },
      log);
  Eigen::Index size = range.size();
  while (size > least && !halves_agree(channels, static_cast<std::size_t>(size))) {
    size = std::max(least, std::min(size - 1, size * 9 / 10));
  }
  return {range.begin, range.begin + size};
}

}  // namespace cdprcal
