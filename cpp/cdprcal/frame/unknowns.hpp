// Private to frame/: what is unknown of a frame, and what is known of it beforehand.
#pragma once

#include "cdprcal/frame/rows.hpp"

namespace cdprcal::detail {

/// Whether any pose (of log `log`; −1: of all) has a reading of a channel.
bool any_reading(const std::vector<FramePose>& poses, int log, Channel channel);

/// Rigid motions of all pulleys from where they are, as shifts along the unknowns' axes: a column
/// each.
Eigen::MatrixXd rigid_motions(const FrameUnknowns& u, const Robot& robot);
/// Whether what is known of pulleys beforehand fixes where the frame is and how it is turned.
bool fixes_place(const FrameUnknowns& u, const Robot& robot);

/// The common unknowns that these poses ask for: pulleys with their priors, offsets, scale where a
/// tracker is there, stiffness where tensions differ. Of points without a tracker no reading shows
/// where the frame is: where the priors do not fix it a convention does, and holds the first pulley
/// and the directions to the next ones.
FrameUnknowns unknowns_of(const Robot& robot, const std::vector<FramePose>& poses, int logs,
                          const FrameOptions& options);

/// The robot file's σ of each channel.
ChannelSigma specified_sigma(const SensorSigma& sigma);

}  // namespace cdprcal::detail
