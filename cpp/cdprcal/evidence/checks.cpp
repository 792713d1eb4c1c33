#include "cdprcal/evidence/checks.hpp"

#include <algorithm>
#include <cstdio>
#include <numeric>

namespace cdprcal {

Checks checks_of(const DiagnosisModel& model) {
  Checks out;
  const DiagnosisSystem system = linearise(model);
  for (int o = 0; o < system.layout.offsets; ++o) {
    if (system.by_common.col(o).norm() > 0.0) ++out.constants;
  }
  // Of the rests, or of the samples in motion where nothing rested: a sample beside one rest reads
  // the same once more.
  const NoiseLevels freedom = channel_sums(model).freedom;
  const auto moving = freedom.begin() + kRestGroups;
  out.readings = std::max(std::accumulate(freedom.begin(), moving, 0.0),
                          std::accumulate(moving, freedom.end(), 0.0));
  return out;
}

DiagnosisModel with_uncertain_noise(DiagnosisModel model) {
  constexpr double kLeastFreedom = 3.0;  // below, t has no variance
  const ChannelSums sums = channel_sums(model);
  for (std::size_t c = 0; c < kNoiseGroups; ++c) {
    if (sums.freedom[c] < 1.0 || !(model.noise[c] > model.floor[c])) continue;
    const double freedom = std::max(kLeastFreedom, sums.freedom[c]);
    model.noise[c] *= std::sqrt(freedom / (freedom - 2.0));
  }
  return model;
}

std::string too_little(const Checks& checks) {
  char text[200];
  std::snprintf(text, sizeof text,
                "too little to say: once the poses are fitted, %.0f readings are left to check the "
                "model by, and %d constants of the sensors to tell; measure at more rests",
                checks.readings, checks.constants);
  return text;
}

}  // namespace cdprcal
