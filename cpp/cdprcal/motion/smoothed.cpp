#include "cdprcal/motion/smoothed.hpp"

#include <Eigen/Cholesky>

namespace cdprcal {
namespace {

/// As far apart as unknowns are: from `b` to `a`.
MotionVector minus(const MotionState& a, const MotionState& b) {
  MotionVector out;
  out << minus(a.pose, b.pose), a.twist - b.twist, a.acceleration - b.acceleration;
  return out;
}

}  // namespace

std::vector<SmoothedSample> smoothed(const Calibration& calibration, const CorrectedRun& run,
                                     double restless) {
  return smoothed(calibration, LateReadings(calibration, run), restless);
}

std::vector<SmoothedSample> smoothed(const Calibration& calibration, const LateReadings& read,
                                     double restless) {
  const Robot& robot = calibration.problem.robot;
  const CorrectedRun& run = read.run;
  Tracker tracker(calibration, restless, {}, read.ahead_s);
  std::vector<TrackerStep> steps;
  std::vector<SmoothedSample> out;
  for (Eigen::Index row = run.rows.begin; row < run.rows.end; ++row) {
    const TrackedSample& now =
        tracker.add(measurement_at(run.log, row, PoseKind::kinematic_pose, robot.cable_count()));
    steps.push_back(tracker.step());
    out.push_back({run.log.time_s[row], now.state, steps.back().covariance, steps.back().agrees});
  }
  for (std::size_t k = out.size() - 1; k-- > 0;) {
    const TrackerStep& next = steps[k + 1];
    if (next.starts) continue;
    // What is known is nowhere quite singular: a little keeps it so in guided directions.
    MotionMatrix predicted = next.predicted_covariance;
    predicted.diagonal().array() += 1e-12 * predicted.diagonal().maxCoeff();
    const Eigen::LDLT<MotionMatrix> ldlt(predicted);
    const MotionMatrix gain = ldlt.solve(next.transition * steps[k].covariance).transpose();
    out[k].state = plus(out[k].state, gain * minus(out[k + 1].state, next.predicted));
    out[k].covariance +=
        gain * (out[k + 1].covariance - next.predicted_covariance) * gain.transpose();
  }
  return out;
}

}  // namespace cdprcal
