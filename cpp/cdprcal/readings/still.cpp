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

/// Whether the means of so many parts of equal length agree in all channels together.
bool parts_agree(const std::vector<Running>& channels, std::size_t end, std::size_t parts) {
  constexpr double kConfidence = 0.95;
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
      const double own = 1.0 / c.signal.variance(count);
      const double away = (c.sum[until] - c.sum[from]) / count - mean;
      weight += own;
      mean += away * own / weight;
      squares += own * away * (away - away * own / weight);
      ++told;
    }
    chi_square += squares;
    freedom += std::max(0, told - 1);
  }
  return freedom == 0 || chi_square <= chi_square_quantile(kConfidence, freedom);
}

/// A drift shows in halves; what goes there and comes back, in smaller parts.
bool is_still(const std::vector<Running>& channels, std::size_t end) {
  return std::ranges::all_of(std::array{2, 4, 8}, [&](std::size_t parts) {
    return parts > end || parts_agree(channels, end, parts);
  });
}

}  // namespace

SampleRange still_since_start(const Log& log, const SampleRange& range, const Signals& signals,
                              Eigen::Index least) {
  std::vector<Running> channels;
  for_each_sensor(
      [&](const Sensor& sensor, const LogMatrix& group) {
        if (sensor.is_inertial()) return;  // a platform hums while it is still
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
  while (size > least && !is_still(channels, static_cast<std::size_t>(size))) {
    size = std::max(least, std::min(size - 1, size * 9 / 10));
  }
  return {range.begin, range.begin + size};
}

}  // namespace cdprcal
