// Private to the library: root mean square of what is finite.
#pragma once

#include <cmath>

#include "cdprcal/types.hpp"

namespace cdprcal {

struct MeanSquare {
  double sum = 0.0;
  int count = 0;
  void add(double value) {
    if (!std::isfinite(value)) return;
    sum += value * value;
    ++count;
  }
  [[nodiscard]] double rms() const { return count > 0 ? std::sqrt(sum / count) : kNaN; }
};

}  // namespace cdprcal
