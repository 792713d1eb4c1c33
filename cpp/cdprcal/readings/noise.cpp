#include "cdprcal/readings/noise.hpp"

#include <algorithm>

#include "cdprcal/readings/equilibrium_detection.hpp"

namespace cdprcal {
namespace {

/// Median over the columns [from, to) that have a reading; `otherwise` without any.
double median_noise(const LogMatrix& values, Eigen::Index from, Eigen::Index to,
                    const SampleRange& run, bool angles, double otherwise) {
  std::vector<double> noise;
  for (Eigen::Index c = from; c < std::min(to, values.cols()); ++c) {
    const auto column = values.col(c).segment(run.begin, run.size());
    if (column.array().isFinite().count() < 3) continue;
    noise.push_back(channel_noise(column, angles));
  }
  if (noise.empty()) return otherwise;
  const auto middle = noise.begin() + static_cast<std::ptrdiff_t>(noise.size() / 2);
  std::nth_element(noise.begin(), middle, noise.end());
  return *middle;
}

}  // namespace

NoiseModel specified_noise(const SensorSigma& sigma) {
  NoiseModel out;
  for (std::size_t c = 0; c < kChannels; ++c) {
    out.channel[c] = {sigma.*kChannelTable[c].of().sigma, 0.0};
  }
  out.wrench_force_N = sigma.wrench_force_N;
  out.wrench_moment_Nm = sigma.wrench_moment_Nm;
  return out;
}

std::array<double, kChannels> sample_noise(const Log& log, const SampleRange& run,
                                           const SensorSigma& sigma) {
  std::array<double, kChannels> out;
  const auto groups = log.groups();
  for (std::size_t c = 0; c < kChannels; ++c) {
    const ChannelRow& row = kChannelTable[c];
    out[c] = median_noise(*groups[static_cast<std::size_t>(row.sensor)], row.first,
                          row.first + row.count, run, row.of().is_angle(), sigma.*row.of().sigma);
  }
  return out;
}

}  // namespace cdprcal
