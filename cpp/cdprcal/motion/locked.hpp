// Where no winch turns: what the platform does then, it does by itself.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "cdprcal/motion/smoothed.hpp"
#include "cdprcal/statics/natural_frequencies.hpp"

namespace cdprcal {

/// Samples of a path, from begin on, without end.
struct LockedStretch {
  std::size_t begin = 0, end = 0;
};

/// One stretch after another in which all cables stay as long as they are, as far as readings tell
/// (turn_over_m, noise) and the path is known. `goes_on`: whether the one that begins there reaches
/// a sample. Empty without lengths.
std::vector<LockedStretch> locked_stretches(
    const Calibration& calibration, const CorrectedRun& run, std::span<const SmoothedSample> path,
    const std::function<bool(std::size_t begin, std::size_t sample)>& goes_on);

/// Whether a time is part of a rest, or within `around_s` of one.
bool is_resting(const Calibration& calibration, double time_s, double around_s = 0.0);

/// How long a stretch lasts [s].
inline double lasts_s(const LockedStretch& stretch, std::span<const SmoothedSample> path) {
  return stretch.end > stretch.begin ? path[stretch.end - 1].time_s - path[stretch.begin].time_s
                                     : 0.0;
}

/// The modes at a pose, with the tensions that balance there; none where there is no such pose.
Modes modes_at(const Robot& robot, const Pose& pose);

}  // namespace cdprcal
