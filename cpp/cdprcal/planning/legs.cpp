#include "cdprcal/planning/legs.hpp"

#include <algorithm>
#include <limits>

#include "cdprcal/planning/pose_grid.hpp"

namespace cdprcal {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
const char* const kTooTight =
    "the path runs so close to the workspace's edge that no duration keeps the platform inside";

}  // namespace

template <class T>
void LegTable::Table<T>::grow(std::size_t to, const T& value) {
  Table<T> larger;
  larger.size = to;
  larger.cells.assign(to * to, value);
  for (std::size_t i = 0; i < size; ++i) {
    for (std::size_t j = 0; j < size; ++j) larger(i, j) = (*this)(i, j);
  }
  *this = std::move(larger);
}

LegTable::LegTable(const PathChecker& checker, const TransitionTimer& timer,
                   std::vector<SetPoint> places, int threads, const ShareDone& progress)
    : checker_(checker),
      timer_(timer),
      places_(std::move(places)),
      given_(places_.size()),
      threads_(threads) {
  fill(0, progress);
  if (stopped_ || connected()) return;
  Box around = Box::empty();
  for (const SetPoint& place : places_) around.include(place.pose.position_m);
  std::array<int, 3> counts{1, 1, 1};
  for (int axis = 0; axis < 3; ++axis) {
    if (around.extent_m()[axis] > 1e-3) counts[axis] = 3;
  }
  for (const Vector3& position : grid_positions(around, counts)) {
    if (auto result = checker_.solver().at(position); result.set_point) {
      places_.push_back(*result.set_point);
    }
  }
  if (places_.size() > given_) fill(given_, progress);
}

void LegTable::fill(std::size_t first, const ShareDone& progress) {
  const std::size_t n = places_.size();
  direct_.grow(n, Timing{});
  obstacle_.grow(n, std::string());
  settled_s_.grow(n, kNever);
  next_.grow(n, -1);
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = std::max(first, i + 1); j < n; ++j) pairs.emplace_back(i, j);
  }
  const auto record = [&](std::size_t i, std::size_t j, const Path& path) {
    if (!path.clear()) {
      obstacle_(i, j) = path.reason;
    } else if (const auto timing = timer_.time(path)) {
      direct_(i, j) = *timing;
      settled_s_(i, j) = timing->transition_s + timing->settling_s;
      next_(i, j) = static_cast<int>(j);
    } else {
      obstacle_(i, j) = kTooTight;
    }
  };
  const bool finished =
      parallel_for(pairs.size(), {.threads = threads_, .progress = progress}, [&](std::size_t p) {
        const auto [i, j] = pairs[p];
        const Path path = checker_.follow(places_[i], places_[j]);
        record(i, j, path);
        record(j, i, reversed(path));
      });
  if (!finished) {
    stopped_ = true;
    return;
  }
  find_detours();
}

/// Floyd and Warshall's shortest ways, for the pairs that have no direct one.
void LegTable::find_detours() {
  const std::size_t n = places_.size();
  bool any = false;
  for (const std::string& why : obstacle_.cells) any = any || !why.empty();
  if (!any) return;
  for (std::size_t via = 0; via < n; ++via) {
    for (std::size_t i = 0; i < n; ++i) {
      if (i == via || settled_s_(i, via) == kNever) continue;
      for (std::size_t j = 0; j < n; ++j) {
        if (j == i || j == via || obstacle_(i, j).empty()) continue;
        const double time = settled_s_(i, via) + settled_s_(via, j);
        if (time < settled_s_(i, j)) {
          settled_s_(i, j) = time;
          next_(i, j) = next_(i, via);
        }
      }
    }
  }
}

bool LegTable::connected() const {
  for (std::size_t i = 0; i < given_; ++i) {
    for (std::size_t j = 0; j < given_; ++j) {
      if (i != j && settled_s_(i, j) == kNever) return false;
    }
  }
  return true;
}

Eigen::MatrixXd LegTable::time_s() const {
  const auto n = static_cast<Eigen::Index>(given_);
  Eigen::MatrixXd time = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t i = 0; i < given_; ++i) {
    for (std::size_t j = 0; j < given_; ++j) {
      if (i == j) continue;
      const std::vector<Leg> legs = way(static_cast<int>(i), static_cast<int>(j));
      double sum = legs.empty() ? kNever : 0.0;
      for (const Leg& leg : legs) sum += leg.timing.transition_s + leg.timing.settling_s;
      if (!legs.empty()) sum += legs.back().timing.dwell_s - legs.back().timing.settling_s;
      time(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = sum;
    }
  }
  return time;
}

std::vector<Leg> LegTable::way(int from, int to) const {
  std::vector<Leg> legs;
  for (int at = from; at != to;) {
    const int next = next_(static_cast<std::size_t>(at), static_cast<std::size_t>(to));
    if (next < 0) return {};
    legs.push_back({next, direct_(static_cast<std::size_t>(at), static_cast<std::size_t>(next))});
    at = next;
  }
  return legs;
}

const std::string& LegTable::obstacle(int from, int to) const {
  return obstacle_(static_cast<std::size_t>(from), static_cast<std::size_t>(to));
}

}  // namespace cdprcal
