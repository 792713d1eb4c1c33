// How the samples of a channel come: their noise, held, rounded or filtered, and what a mean of so
// many of them is worth.
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "cdprcal/readings/equilibrium_detection.hpp"

namespace cdprcal {

/// One channel's samples at rest. The mean of many has a variance of its own: what rounding leaves
/// in it, whatever their number, and the rest of σ² over the number of independent ones.
struct Signal {
  double sigma = 0.0;          ///< of one reading
  double rounding = 0.0;       ///< the part of it that the mean over a rest keeps
  double rows = 1.0;           ///< rows of the log that are worth one independent reading
  double resolution = 0.0;     ///< step of the readings where it shows beside their noise, else 0
  double hold_rows = 1.0;      ///< rows a fresh reading
  double correlation_s = 0.0;  ///< time constant of the filter that the noise went through
  double period_s = 0.0;       ///< from one fresh reading to the next
  double loudest = 1.0;        ///< σ of the column that is noisiest, in σ
  double repeats = 1.0;        ///< share of the rows of rests that say again what the last did

  /// White, every row: what readings are taken for where nothing says otherwise.
  [[nodiscard]] bool is_white() const { return rows == 1.0 && rounding == 0.0; }
  /// How many independent readings so many rows hold.
  [[nodiscard]] double effective(double samples) const;
  /// Of the mean over so many rows, whose middle is so long after the run's first row. A filter may
  /// have begun there, with a raw reading that nothing averaged: it fades as the filter forgets.
  [[nodiscard]] double variance(double samples,
                                double run_time_s = std::numeric_limits<double>::infinity()) const;

 private:
  [[nodiscard]] double share_of_first(double samples, double run_time_s) const;
};
using Signals = std::array<Signal, kChannels>;

/// Those of a run, from all readings of a channel together.
/// - σ: second differences, robust to motion (channel_noise; median over the channel's columns)
/// - held: fresh_rows
/// - rounded: the smallest step, where the others are its multiples and it is as coarse as the
///   noise. A mean of readings x + noise, each rounded to q, is off by up to q/2 as x is placed:
///   for σ of noise its variance over x is Σ q²/(2π²k²) exp(−(2πkσ/q)²), q²/12 without noise
/// - filtered: at rest (the inner part of `rests`) differences over two rows exceed those over one
///   by what a first-order filter would do, more than chance does. The growth of a filter's
///   slackens over four rows and more and does not turn round; that of a motion quickens, a swing's
///   turns: no filter.
/// Channels that are absent have the robot file's σ.
Signals signals(const Log& log, const SampleRange& run, const std::vector<Equilibrium>& rests,
                const SensorSigma& sigma, double window_s = DetectionOptions().window_s);

/// The same with rests that are given, all of which count.
Signals signals_within(const Log& log, const SampleRange& run,
                       const std::vector<SampleRange>& rests, const SensorSigma& sigma);

/// Those of two sets of readings together, by their weights.
Signals mixed(const Signals& a, double weight_a, const Signals& b, double weight_b);

/// A channel's signal for one of its columns, whose own noise is known.
Signal of_column(Signal channel, double noise);

}  // namespace cdprcal
