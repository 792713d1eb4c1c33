// Files as they may come: a few bytes of a text changed, lost or repeated.
#pragma once

#include <cstdint>
#include <string>

#include "random_robot.hpp"

namespace cdprcal::test {

inline std::string damaged(std::string text, Rng& rng) {
  for (std::uint64_t n = 1 + rng() % 3; n > 0; --n) {
    const std::size_t at = rng() % text.size();
    switch (rng() % 3) {
      case 0:
        text[at] = static_cast<char>(rng() % 256);
        break;
      case 1:
        text.erase(at, 1 + rng() % 20);
        break;
      default:
        text.insert(at, text.substr(rng() % text.size(), 1 + rng() % 20));
    }
  }
  return text;
}

}  // namespace cdprcal::test
