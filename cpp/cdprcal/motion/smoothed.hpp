// The platform's motion with all of a run's readings behind each moment.
#pragma once

#include "cdprcal/motion/late_readings.hpp"
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
/// What is likely of the jerk rounds the peaks of an acceleration off, all in the same way:
/// `restless` times as much jerk gives ones that are noisier and hardly wrong on the average, as
/// those need who put them into a law (undersmoothing: Hall 1992). Throws InputError as track()
/// does.
std::vector<SmoothedSample> smoothed(const Calibration& calibration, const CorrectedRun& run,
                                     double restless = 1.0);
/// The same of a run whose late readings are read already.
std::vector<SmoothedSample> smoothed(const Calibration& calibration, const LateReadings& read,
                                     double restless = 1.0);

}  // namespace cdprcal
