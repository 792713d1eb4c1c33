// Loops over several threads: each element once, and what goes wrong in a thread reaches the
// caller.
#include "cdprcal/parallel.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

constexpr auto kAWhile = std::chrono::microseconds(200);

TEST(Parallel, EveryElementOnceWhateverTheThreadsAndTheGrain) {
  for (const std::size_t count : {0, 1, 63, 64, 65, 1000}) {
    for (const int threads : {0, 1, 2, 7}) {
      for (const std::size_t grain : {0, 1, 64, 5000}) {
        std::vector<int> calls(count, 0);
        EXPECT_TRUE(parallel_for(count, {.threads = threads, .grain = grain},
                                 [&](std::size_t i) { ++calls[i]; }));
        EXPECT_EQ(std::count(calls.begin(), calls.end(), 1), static_cast<std::ptrdiff_t>(count))
            << threads << " threads, " << grain << " at once";
      }
    }
  }
}

TEST(Parallel, ARangeIsAsLongAsAskedButTheLast) {
  std::vector<std::size_t> begins, ends;
  EXPECT_TRUE(
      parallel_ranges(10, {.threads = 1, .grain = 4}, [&](std::size_t from, std::size_t to) {
        begins.push_back(from);
        ends.push_back(to);
      }));
  EXPECT_EQ(begins, (std::vector<std::size_t>{0, 4, 8}));
  EXPECT_EQ(ends, (std::vector<std::size_t>{4, 8, 10}));
}

TEST(Parallel, WorkIsDoneByAsManyThreadsAsAsked) {
  // The three meet: none goes on before all are there. Then more elements never meet a fourth.
  std::atomic<int> here{0}, most{0};
  parallel_for(3, {.threads = 3}, [&](std::size_t) {
    ++here;
    while (here < 3) std::this_thread::yield();
  });
  here = 0;
  parallel_for(200, {.threads = 3}, [&](std::size_t) {
    const int now = ++here;
    for (int seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {
    }
    std::this_thread::sleep_for(kAWhile);
    --here;
  });
  EXPECT_LE(most, 3);
}

/// Runs what throws at one element; says how many elements were begun.
int begun_until_failure(const ParallelOptions& options, std::size_t where) {
  std::atomic<int> begun{0};
  std::string message;
  try {
    parallel_for(100'000, options, [&](std::size_t i) {
      ++begun;
      if (i == where) throw InputError("element " + std::to_string(i));
      std::this_thread::sleep_for(kAWhile);
    });
    ADD_FAILURE() << "nothing was thrown";
  } catch (const InputError& error) {
    message = error.what();
  }
  EXPECT_EQ(message, "element " + std::to_string(where));
  return begun;
}

TEST(Parallel, AFailureInAThreadReachesTheCallerAndStopsTheOthers) {
  const ShareDone go_on = [](double) { return true; };
  for (const int threads : {1, 2, 4}) {
    for (const ShareDone& progress : {ShareDone{}, go_on}) {
      EXPECT_LT(begun_until_failure({.threads = threads, .progress = progress}, 0), 50'000);
      EXPECT_LT(begun_until_failure({.threads = threads, .progress = progress}, 40), 50'000);
    }
  }
}

TEST(Parallel, OfSeveralFailuresOneReachesTheCaller) {
  EXPECT_THROW(
      parallel_for(8, {.threads = 4}, [](std::size_t) { throw std::runtime_error("each"); }),
      std::runtime_error);
}

TEST(Parallel, ProgressRunsInTheCallersThreadAndCanStop) {
  std::atomic<int> begun{0};
  const std::thread::id caller = std::this_thread::get_id();
  double last = -1.0;
  const auto half_way = [&](double share) {
    EXPECT_EQ(std::this_thread::get_id(), caller);
    EXPECT_GE(share, last);
    EXPECT_LE(share, 1.0);
    last = share;
    return share < 0.001;
  };
  EXPECT_FALSE(parallel_for(100'000, {.threads = 2, .progress = half_way}, [&](std::size_t) {
    EXPECT_NE(std::this_thread::get_id(), caller);
    ++begun;
    std::this_thread::sleep_for(kAWhile);
  }));
  EXPECT_GE(begun, 100);
  EXPECT_LT(begun, 50'000);
}

TEST(Parallel, AFailureOfTheProgressReachesTheCallerAfterTheThreadsHaveEnded) {
  std::atomic<int> begun{0}, ended{0};
  const auto fails = [](double share) -> bool {
    if (share > 0.0) throw std::runtime_error("progress");
    return true;
  };
  EXPECT_THROW(parallel_for(100'000, {.threads = 2, .progress = fails},
                            [&](std::size_t) {
                              ++begun;
                              std::this_thread::sleep_for(kAWhile);
                              ++ended;
                            }),
               std::runtime_error);
  EXPECT_EQ(begun, ended);
  EXPECT_LT(begun, 50'000);
}

}  // namespace
}  // namespace cdprcal
