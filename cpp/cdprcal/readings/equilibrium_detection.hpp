// Finds the intervals of a log in which the platform rests.
#pragma once

#include <vector>

#include "cdprcal/model/robot.hpp"
#include "cdprcal/readings/log.hpp"

namespace cdprcal {

/// Rest is judged window by window. In a window at rest
/// - lengths, swivels and attitude scatter no more than their own noise explains (χ² test at
///   `confidence`), plus a motion of `tolerance` σ, which no estimate notices;
/// - the mean tension of the first half agrees with that of the second (t-like test on the
///   scatter found there, plus the same tolerance): a controller may chatter at a platform at rest.
/// The noise of a channel is read off the log itself (second differences, robustly).
struct DetectionOptions {
  double window_s = 1.0;      ///< the platform must look at rest at least this long
  double confidence = 0.999;  ///< of each test
  double tolerance = 0.05;    ///< motion that does not matter, in units of the sensor's σ
};

/// One interval at rest; `samples` are row numbers of the log.
struct Equilibrium {
  SampleRange samples;
  double begin_s = 0.0;
  double end_s = 0.0;
};

/// Equilibria in `range` of a log, in time order. Channels that are absent do not vote; throws
/// InputError when neither lengths, swivels nor attitude are there to tell.
std::vector<Equilibrium> detect_equilibria(const Log& log, const SampleRange& range,
                                           const SensorSigma& sigma,
                                           const DetectionOptions& options = {});

/// A rest without half a window on either side, at most a quarter of the rest, and nothing where
/// the run itself ends. Detection judges whole windows, so their outermost part may hold the first
/// or the last of a slow motion: far below the noise of a sample, but not below that of a mean.
SampleRange inner_part(const Log& log, const SampleRange& run, const Equilibrium& rest,
                       double window_s);

/// White noise [same unit] of a channel, from its second differences (robust to motion); floored
/// at its resolution/√12. NaN entries are passed over; 0 with fewer than three samples. `angles`:
/// readings that jump by 2π are no jump.
double channel_noise(const Eigen::Ref<const Eigen::VectorXd>& values, bool angles = false);

/// Angles [rad] without jumps of 2π; NaN entries are passed over.
Eigen::VectorXd unwrapped(Eigen::VectorXd angles_rad);

}  // namespace cdprcal
