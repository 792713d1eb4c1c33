// Private to frame/: what a frame takes all cables to have in common, and each may have of its own.
#pragma once

#include "cdprcal/frame/solved.hpp"

namespace cdprcal::detail {

/// Adds numbers that each cable has of its own to the unknowns, known to be about none.
void add_own(const Robot& robot, Own what, FrameUnknowns& unknowns);

/// σ allows for belts that end at arms of other lengths, for drums of other diameters and for belts
/// at other distances from the plane: each bends a frame that takes them to be alike, and often no
/// residual shows it. Weighed by how well the readings go with each, as all evidence is (Bayes).
/// Returns what each cable has of its own beyond doubt, in words.
std::vector<std::string> allow_for_own(const FrameOptions& options, Solved& solved);

}  // namespace cdprcal::detail
