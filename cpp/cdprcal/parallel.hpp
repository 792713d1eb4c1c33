// Loops over several threads whose failures reach the caller.
#pragma once

#include <cstddef>
#include <functional>

namespace cdprcal {

/// Called from the calling thread with the share in [0, 1] that is done; false stops.
using ShareDone = std::function<bool(double)>;

struct ParallelOptions {
  int threads = 0;          ///< at most so many work at once; 0: one a core
  std::size_t grain = 1;    ///< elements that a thread takes at a time; none is started for fewer
  ShareDone progress = {};  ///< called every few milliseconds
};

/// Calls work(begin, end) for ranges that together cover [0, count) once, of `grain` elements each
/// (the last one may be shorter), on several threads. Which thread takes which range depends on
/// timing: for the same result on every number of threads, an element must not depend on others.
/// Returns false when `progress` stopped it. The first exception thrown by `work` or `progress`, or
/// because no thread could be started, stops all threads after their range and is thrown here.
bool parallel_ranges(std::size_t count, const ParallelOptions& options,
                     const std::function<void(std::size_t, std::size_t)>& work);

/// The same, work(i) for each i in [0, count).
template <class Work>
bool parallel_for(std::size_t count, const ParallelOptions& options, const Work& work) {
  return parallel_ranges(count, options, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) work(i);
  });
}

}  // namespace cdprcal
