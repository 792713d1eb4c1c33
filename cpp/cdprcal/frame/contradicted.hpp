// Private to frame/: pulleys that are not where the robot file says that they are known to be.
#pragma once

#include "cdprcal/frame/solved.hpp"

namespace cdprcal::detail {

/// A pulley that the lengths and all other pulleys contradict.
struct Contradiction {
  int cable = 0;
  double distance_m = 0.0;  ///< from where the file has it
  double sigmas = 0.0;      ///< by its position_sigma_m and what the others leave open: √χ²
};

/// Worst first, each by those that are left: one pulley that is wrong turns the whole frame. The
/// noise is that of a fit to the lengths alone, or the wrong prior would be laid to it. None where
/// the file says no σ, the priors do not fix the frame, or few readings are to spare.
std::vector<Contradiction> contradicted(const Solved& solved, int max_iterations);

/// "pulley 3 is 100 mm (33 σ) from where the robot file has it, by …"; farther away than a robot of
/// this size is wide none is, and something else is wrong.
std::string in_words(const std::vector<Contradiction>& contradictions, double size_m);

}  // namespace cdprcal::detail
