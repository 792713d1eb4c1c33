// Tensions that are given from outside are one a cable, before anything reads beyond them.
#pragma once

#include <string>

#include "cdprcal/error.hpp"
#include "cdprcal/types.hpp"

namespace cdprcal {

/// Throws InputError unless there is one tension a cable.
inline void require_one_a_cable(const CableVector& tension_N, int cables) {
  if (tension_N.size() == cables) [[likely]]
    return;
  throw InputError("tension_N: has " + std::to_string(tension_N.size()) + " numbers for " +
                   std::to_string(cables) + " cables; give one a cable");
}

}  // namespace cdprcal
