#include "cdprcal/readings/noise.hpp"

#include <algorithm>

#include "cdprcal/readings/equilibrium_detection.hpp"

namespace cdprcal {
namespace {

std::array<double, kChannels> by_channel(const SensorSigma& sigma) {
  return {sigma.length_m,  sigma.swivel_rad,       sigma.attitude_rad,    sigma.attitude_rad,
          sigma.tension_N, sigma.absolute_yaw_rad, sigma.direct_length_m, sigma.position_m};
}

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

const char* to_string(Channel channel) {
  switch (channel) {
    case Channel::length:
      return "length";
    case Channel::swivel:
      return "swivel";
    case Channel::roll_pitch:
      return "roll_pitch";
    case Channel::yaw:
      return "yaw";
    case Channel::balance:
      return "balance";
    case Channel::absolute_yaw:
      return "absolute_yaw";
    case Channel::direct_length:
      return "direct_length";
    case Channel::position:
      return "position";
  }
  return "unknown";
}

NoiseModel specified_noise(const SensorSigma& sigma) {
  const std::array<double, kChannels> specified = by_channel(sigma);
  NoiseModel out;
  for (std::size_t c = 0; c < kChannels; ++c) out.channel[c] = {specified[c], 0.0};
  out.wrench_force_N = sigma.wrench_force_N;
  out.wrench_moment_Nm = sigma.wrench_moment_Nm;
  return out;
}

std::array<double, kChannels> sample_noise(const Log& log, const SampleRange& run,
                                           const SensorSigma& sigma) {
  const std::array<double, kChannels> specified = by_channel(sigma);
  return {median_noise(log.length_m, 0, kMaxCables, run, false, specified[0]),
          median_noise(log.swivel_rad, 0, kMaxCables, run, true, specified[1]),
          median_noise(log.roll_pitch_yaw_rad, 0, 2, run, true, specified[2]),
          median_noise(log.roll_pitch_yaw_rad, 2, 3, run, true, specified[3]),
          median_noise(log.tension_N, 0, kMaxCables, run, false, specified[4]),
          median_noise(log.absolute_yaw_rad, 0, 1, run, true, specified[5]),
          median_noise(log.direct_length_m, 0, kMaxCables, run, false, specified[6]),
          median_noise(log.position_m, 0, 3, run, false, specified[7])};
}

}  // namespace cdprcal
