// Private to frame/: what is unknown of a frame, and what is known of it beforehand.
#pragma once

#include "cdprcal/frame/rows.hpp"

namespace cdprcal::detail {

/// Whether any pose (of log `log`; −1: of all) has a reading of a channel.
bool any_reading(const std::vector<FramePose>& poses, int log, Channel channel);

/// The common unknowns that these poses ask for: pulleys with their priors, offsets, scale where a
/// tracker is there, stiffness where tensions differ. Of points without a tracker no reading shows
/// where the frame is: where the priors do not fix it a convention does (hold_place).
FrameUnknowns unknowns_of(const Robot& robot, const std::vector<FramePose>& poses, int logs,
                          const FrameOptions& options);

/// The robot file's σ of each channel.
ChannelSigma specified_sigma(const SensorSigma& sigma);

}  // namespace cdprcal::detail
