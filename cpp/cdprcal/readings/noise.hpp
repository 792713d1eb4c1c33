// How much a reading may be wrong: as the robot file says, or as the readings themselves show.
#pragma once

#include <array>
#include <cmath>

#include "cdprcal/model/robot.hpp"
#include "cdprcal/readings/channel.hpp"
#include "cdprcal/readings/measurement.hpp"
#include "cdprcal/readings/signal.hpp"

namespace cdprcal {

/// Two components, one σ each.
struct ChannelNoise {
  double pose = 0.0;  ///< shared by all samples of a pose (model, drift): does not average out
  Signal sample;      ///< from sample to sample: the mean of N has less, σ/√N where it is white
  [[nodiscard]] double sigma(int samples) const {
    return std::sqrt(pose * pose + sample.variance(samples));
  }
  [[nodiscard]] double sigma(const Measurement& m) const {
    return std::sqrt(pose * pose + sample.variance(m.samples, m.run_time_s));
  }
};

/// One ChannelNoise a channel; the balance's is that of a tension [N].
struct NoiseModel {
  std::array<ChannelNoise, kChannels> channel;
  /// What the balance itself is wrong by, beyond the load cells, along each axis.
  double wrench_force_N = 0.0;
  double wrench_moment_Nm = 0.0;
  [[nodiscard]] const ChannelNoise& operator[](Channel c) const {
    return channel[static_cast<std::size_t>(c)];
  }
  ChannelNoise& operator[](Channel c) { return channel[static_cast<std::size_t>(c)]; }
};

/// The robot file's σ (eq. 18), for poses and samples alike: nothing averages out.
NoiseModel specified_noise(const SensorSigma& sigma);

}  // namespace cdprcal
