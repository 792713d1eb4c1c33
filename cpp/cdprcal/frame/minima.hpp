// Private to frame/: the best of the minima that several starts end in, and which others there are.
#pragma once

#include "cdprcal/frame/minimise.hpp"

namespace cdprcal::detail {

/// What several starts ended in, by one noise.
struct Minima {
  std::vector<FrameState> each;  ///< the best first
  int starts = 0;                ///< how many were followed to their ends
  int of_best = 0;               ///< how many of them ended in the best
  bool drawn = false;            ///< whether there were more starts than those given

  /// Whether a better one than the best would hardly have been missed.
  [[nodiscard]] bool is_sure() const { return !drawn || of_best > 1 || each.size() == 1; }
};

/// Of closed forms the best of `begin`; the first that two of these agree upon ends the search. The
/// poses of other platforms hold a frame in a minimum that is not the best: beside `begin` frames
/// are tried that are drawn from what the robot file says of the pulleys, until one ends in the
/// best, or, where others end elsewhere, several do (`draw`: whether).
Minima minima(const FrameProblem& problem, std::vector<FrameState> begin, bool draw,
              int max_iterations);

/// By how much the distance between two pulleys differs at the most from one frame to another.
double apart_m(const FrameProblem& problem, const FrameState& a, const FrameState& b);

}  // namespace cdprcal::detail
