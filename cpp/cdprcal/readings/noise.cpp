#include "cdprcal/readings/noise.hpp"

namespace cdprcal {
NoiseModel specified_noise(const SensorSigma& sigma) {
  NoiseModel out;
  for (std::size_t c = 0; c < kChannels; ++c) {
    out.channel[c] = {sigma.*kChannelTable[c].of().sigma, {}};
  }
  out.wrench_force_N = sigma.wrench_force_N;
  out.wrench_moment_Nm = sigma.wrench_moment_Nm;
  return out;
}

}  // namespace cdprcal
