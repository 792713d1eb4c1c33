#include "cdprcal/calibration/calibrate.hpp"
#include "cdprcal/frame/poses.hpp"

namespace cdprcal::detail {

FramePoseSet calibrated_poses(const Robot& robot, const Log& log) {
  CalibrateOptions options;
  options.allow_for_effects = false;
  const Calibration found = calibrate(robot, log, options);
  FramePoseSet out;
  out.logs = 1;
  for (std::size_t i = 0; i < found.problem.measurements.size(); ++i) {
    const Measurement& m = found.problem.measurements[i];
    if (m.kind != PoseKind::static_pose) continue;
    const auto row = std::lower_bound(log.time_s.begin(), log.time_s.end(), m.time_s);
    out.poses.push_back({m, 0, static_cast<int>(row - log.time_s.begin())});
    out.guess.push_back(found.result.poses[i]);
  }
  return out;
}

}  // namespace cdprcal::detail
