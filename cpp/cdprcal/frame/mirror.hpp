// Private to frame/: which of its two mirror images a frame is that lengths alone have shown.
#pragma once

#include <array>
#include <optional>

#include "cdprcal/frame/minimise.hpp"

namespace cdprcal::detail {

/// Evidence from which on one of two is said to be better [nat], as everywhere here.
inline constexpr double kEvidence = 3.0;

/// Who tells a frame from its mirror image.
enum class MirrorTold {
  by_readings,  ///< a tracker, or what is known of pulleys: the other image fits worse
  by_file,      ///< the file's positions as a whole agree with one only
  by_weight,    ///< cables pull: in the other image more poses hang above them, or in the floor
  by_nobody
};

/// Which share of the weight no pull of the cables at this pose holds up, 0 to 1; moments and
/// limits aside, so where cables would have to push it is large. 0 in a plane that lies.
double unheld_share(const Robot& robot, const Pose& pose);

/// Of the weight: where cables that pull leave more of it, noise of the pose is no excuse.
inline constexpr double kUnheld = 0.5;

/// Of points: pulleys that may as well stand on the other side of the plane (or line) that all
/// poses lie in to within the noise of a length, alone or together: neither what is known of them
/// nor the file's places, all together, tell the sides.
std::vector<int> untold_sides(const FrameProblem& problem, const FrameState& state, double noise_m);

/// Of such poses: puts pulleys on the sides that agree best with the file, where others do than the
/// present ones.
void choose_sides(const FrameProblem& problem, FrameState& state, double noise_m,
                  int max_iterations);

/// Of points, whose lengths show no order of the pulleys: two that agree with the file's places far
/// better when they are exchanged, as columns in another order make them.
std::optional<std::array<int, 2>> exchanged(const FrameProblem& problem, const FrameState& state);

/// Of points without a tracker: takes the frame's mirror image in its place where that is the
/// better one.
MirrorTold choose_image(const FrameProblem& problem, FrameState& state, int max_iterations);

}  // namespace cdprcal::detail
