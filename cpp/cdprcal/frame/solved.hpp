// Private to frame/: a frame solved: where everything stands, and how well that is known.
#pragma once

#include "cdprcal/frame/determined.hpp"

namespace cdprcal::detail {

/// Chance that of all pulleys, or of all poses, one is accused that is as it should be.
inline constexpr double kFalseAlarm = 0.01;

/// One problem at its minimum.
struct Solved {
  FrameProblem problem;
  FrameState state;
  FrameInformation information;
  Knowledge known;
  MirrorTold image = MirrorTold::by_readings;
};

/// The minimum from where the state is, the noise of each channel from its residuals.
void solve(Solved& s, int max_iterations);

/// Whether readings are to spare: with few a frame can be bent to any of them.
bool to_spare(const Solved& s);
/// Leaves out poses whose misfit no pose in so many has by chance, beside the median of all.
std::vector<LeftOutPose> leave_out(Solved& s);

/// Belts outside the plane at a common distance: solved again with one more unknown, where the
/// readings say so.
void try_off_plane(Solved& s, int max_iterations);

/// Residuals of lengths in metres, one vector a pose; NaN where nothing was read.
std::vector<Eigen::VectorXd> length_residuals(const Solved& s);
double rms(const std::vector<Eigen::VectorXd>& residuals);
/// Rms of the lengths at poses that the frame was not fitted to: every fifth at a time.
double held_out_rms(const Solved& s, int max_iterations);

}  // namespace cdprcal::detail
