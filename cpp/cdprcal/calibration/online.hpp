// The estimate while the robot is being measured: a rest at a time, before the log is complete.
#pragma once

#include "cdprcal/calibration/calibrate.hpp"

namespace cdprcal {

/// Poses the same problem as calibrate() on what was read so far, keeps what was solved, and starts
/// from there when more comes; the noise is taken from the residuals, and outliers are left out,
/// whenever the poses have become a tenth more. calibrate() on the finished log has the last word.
class OnlineCalibration {
 public:
  /// options.at_s, segment and guess must be unset. Throws InputError.
  explicit OnlineCalibration(const Robot& robot, const CalibrateOptions& options = {});

  /// Takes what was read since the last call: a stretch of the log without gaps, best up to the end
  /// of a rest. The first sample of the first stretch is the reference. Returns the estimate after
  /// it; `result.status` is what calibrate() would say, `unobservable` while there is too little.
  /// Throws InputError as prepare() does, and for a stretch that does not follow the last one.
  const Calibration& add(const Log& since_last);

  /// The estimate so far; nothing was measured before the first add().
  [[nodiscard]] const Calibration& calibration() const { return calibration_; }

 private:
  void append(const Log& since_last, Calibration&& stretch);
  void update();

  Robot robot_;
  CalibrateOptions options_;
  bool explain_;
  Calibration all_;           ///< with every moment that was read
  Calibration calibration_;   ///< with those that are independent, and what it may lack
  double samples_ = 0.0;      ///< so far, behind the signals
  double noise_poses_ = 0.0;  ///< behind problem.noise
  double last_s_ = -std::numeric_limits<double>::infinity();
};

}  // namespace cdprcal
