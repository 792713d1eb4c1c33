// Private to frame/: which poses logs hold.
#pragma once

#include "cdprcal/frame/rows.hpp"

namespace cdprcal::detail {

/// Poses of all logs, one after the other.
struct FramePoseSet {
  std::vector<FramePose> poses;
  int logs = 0;
  std::vector<Pose> guess;  ///< where they may be; empty: unknown
};

/// Samples or rests, as the options say. Logs whose lengths are all relative are calibrated first:
/// their rests, and where those are. Throws InputError for logs without lengths or of other cables.
FramePoseSet frame_poses(const Robot& robot, const std::vector<Log>& logs,
                         const FrameOptions& options);

/// Rests of a log of relative lengths, with the poses that calibration finds with the file's
/// pulleys.
FramePoseSet calibrated_poses(const Robot& robot, const Log& log);

}  // namespace cdprcal::detail
