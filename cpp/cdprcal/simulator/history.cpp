#include "cdprcal/simulator/history.hpp"

#include <algorithm>

namespace cdprcal {

std::uint64_t stream(std::uint64_t seed, std::uint64_t index) {
  return (seed + 1) * 0x9e3779b97f4a7c15ULL ^ (index * 0xd1342543de82ef95ULL + 1);
}

CableVector directions_left(int cable_count, RandomNormal random) {
  CableVector out(cable_count);
  for (double& s : out) s = std::clamp(2.0 * random(), -1.0, 1.0);
  return out;
}

}  // namespace cdprcal
