// The platform's motion with all of a run's readings behind each moment.
#pragma once

#include "cdprcal/effects/corrected_run.hpp"
#include "cdprcal/motion/tracker.hpp"

namespace cdprcal {

/// What all readings say of one sample.
struct SmoothedSample {
  double time_s = kNaN;
  MotionState state;
  MotionMatrix covariance;
  bool trusted = false;
};

/// The tracker's filter, and back along it (Rauch, Tung and Striebel 1965), of each row of a run.
/// Throws InputError as track() does.
std::vector<SmoothedSample> smoothed(const Calibration& calibration, const CorrectedRun& run);

}  // namespace cdprcal
