// What a robot did before power-on, which nobody recorded.
#pragma once

#include <cstdint>

#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal {

/// Independent random streams of one seed, so that one sensor's noise does not depend on what the
/// others do.
std::uint64_t stream(std::uint64_t seed, std::uint64_t index);

/// How its last motion left what lags in each cable, in [−1, 1]: mostly at an end.
CableVector directions_left(int cable_count, RandomNormal random);

}  // namespace cdprcal
