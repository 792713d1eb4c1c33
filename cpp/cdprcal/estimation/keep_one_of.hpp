// Thins out what shares its errors.
#pragma once

#include <vector>

namespace cdprcal {

/// Of those values that are `counted` (by their index) only the first of every so many stays; all
/// others do.
template <class T, class Counted>
void keep_one_of(std::size_t every, const Counted& counted, std::vector<T>& values) {
  std::size_t seen = 0, kept = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (counted(i) && seen++ % every != 0) continue;
    values[kept++] = values[i];
  }
  values.resize(kept);
}

}  // namespace cdprcal
