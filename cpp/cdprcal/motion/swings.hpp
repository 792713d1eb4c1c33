// How fast a platform with locked winches swings: as it did, and as the model has it.
#pragma once

#include <span>
#include <vector>

#include "cdprcal/motion/smoothed.hpp"

namespace cdprcal {

/// One mode of the free motions (free_motion_modes).
struct Swing {
  double model_hz = kNaN;
  double measured_hz = kNaN;  ///< of the motion's peak that has its shape; NaN: there is none
  double size_m =
      0.0;  ///< root mean square of the motion in it [m]: kinetic, as the mass would shift
};

/// Over the longest stretch of a run in which no winch turns and the platform little, a minute of
/// it at most: the modes about its mean pose, with the tensions that balance there, and the peaks
/// of the motion's spectrum (Hann's window). Empty where no such stretch lasts four periods of the
/// slowest mode, or no motion is left to the platform.
std::vector<Swing> swings(const Calibration& calibration, const CorrectedRun& run,
                          std::span<const SmoothedSample> path);

}  // namespace cdprcal
