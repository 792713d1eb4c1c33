// What was read during a rest, as one reading with its uncertainty.
#pragma once

#include "cdprcal/readings/log.hpp"

namespace cdprcal {

/// Mean of the readings over an interval at rest. Channels in the order of the log's columns:
/// lengths [m], swivels [rad], tensions [N], roll, pitch, yaw [rad], then those of absolute
/// sensors; groups that the log does not have are left out, a channel without a reading is NaN.
struct EquilibriumMean {
  Eigen::VectorXd mean;        ///< [c]; angles near the first reading, not wrapped
  Eigen::MatrixXd covariance;  ///< [c, c] of the mean; 0 for a channel with one reading
  /// [c] how many independent readings the channel's are worth: N / (1 + 2 Σ ρₖ), ρₖ their
  /// autocorrelation (Geyer's initial positive sequence). A sensor that is sampled faster than its
  /// noise changes, or a platform that still swings, does not get certain by repetition.
  Eigen::VectorXd effective_samples;
};

/// Throws InputError for an empty range or one outside the log.
EquilibriumMean equilibrium_mean(const Log& log, const SampleRange& samples);

}  // namespace cdprcal
