#include "cdprcal/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace cdprcal {
namespace {

/// The first exception of several threads.
class FirstFailure {
 public:
  /// To be called where an exception is being handled.
  void record() {
    const std::lock_guard lock(mutex_);
    if (!exception_) exception_ = std::current_exception();
  }
  /// To be called after the threads have ended.
  void rethrow() const {
    if (exception_) std::rethrow_exception(exception_);
  }

 private:
  std::mutex mutex_;
  std::exception_ptr exception_;
};

}  // namespace

bool parallel_ranges(std::size_t count, const ParallelOptions& options,
                     const std::function<void(std::size_t, std::size_t)>& work) {
  const std::size_t grain = std::max<std::size_t>(options.grain, 1);
  const std::size_t ranges = count / grain + (count % grain != 0 ? 1 : 0);
  std::atomic<std::size_t> next{0}, finished{0};
  std::atomic<bool> stop{false};
  FirstFailure failure;
  const auto run = [&] {
    try {
      for (std::size_t range = next++; range < ranges && !stop; range = next++) {
        const std::size_t begin = range * grain;
        const std::size_t end = begin + std::min(grain, count - begin);
        work(begin, end);
        finished += end - begin;
      }
    } catch (...) {  // beyond the thread it would end the process
      failure.record();
      stop = true;
    }
  };
  const auto asked = static_cast<std::size_t>(std::max(options.threads, 0));
  const std::size_t cores = std::max(1U, std::thread::hardware_concurrency());
  const std::size_t threads = std::min(asked > 0 ? asked : cores, ranges);
  bool wanted = true;
  std::vector<std::jthread> pool;
  try {
    // This thread is one of them, unless it has to report.
    for (std::size_t t = options.progress ? 0 : 1; t < threads; ++t) pool.emplace_back(run);
    if (!options.progress) run();
    while (options.progress && !stop && finished < count) {
      wanted = options.progress(static_cast<double>(finished) / static_cast<double>(count));
      if (!wanted) break;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    if (!wanted) stop = true;
  } catch (...) {
    failure.record();
    stop = true;
  }
  pool.clear();  // joins them
  failure.rethrow();
  return wanted;
}

}  // namespace cdprcal
