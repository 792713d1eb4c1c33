#include "cdprcal/planning/order.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "cdprcal/error.hpp"
#include "cdprcal/readings/turn_over.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Held & Karp: the cheapest way through every set of poses to each of its members.
Tour exact_tour(const Eigen::MatrixXd& time_s) {
  const int k = static_cast<int>(time_s.rows()) - 1;
  const std::size_t sets = std::size_t{1} << k;
  std::vector<double> cost(sets * k, kInfinite);
  std::vector<int> before(sets * k, -1);
  for (int p = 0; p < k; ++p) cost[(std::size_t{1} << p) * k + p] = time_s(0, p + 1);
  for (std::size_t set = 1; set < sets; ++set) {
    for (int last = 0; last < k; ++last) {
      const double so_far = cost[set * k + last];
      if (so_far == kInfinite) continue;
      for (int next = 0; next < k; ++next) {
        if ((set >> next & 1) != 0) continue;
        const std::size_t to = (set | std::size_t{1} << next) * k + next;
        const double time = so_far + time_s(last + 1, next + 1);
        if (time < cost[to]) {
          cost[to] = time;
          before[to] = last;
        }
      }
    }
  }
  Tour tour{{}, kInfinite, true};
  const std::size_t all = sets - 1;
  int last = -1;
  for (int p = 0; p < k; ++p) {
    if (cost[all * k + p] < tour.time_s) {
      tour.time_s = cost[all * k + p];
      last = p;
    }
  }
  for (std::size_t set = all; last >= 0;) {
    tour.order.push_back(last);
    const int previous = before[set * k + last];
    set &= ~(std::size_t{1} << last);
    last = previous;
  }
  std::reverse(tour.order.begin(), tour.order.end());
  return tour;
}

/// A tour as places; path[0] = 0 is the start and stays there.
class LocalSearch {
 public:
  LocalSearch(const Eigen::MatrixXd& time_s, std::vector<int> path)
      : time_s_(time_s), path_(std::move(path)) {}

  /// 2-opt and or-opt until neither helps.
  void improve() {
    while (reverse_a_stretch() || move_a_stretch()) {
    }
  }
  [[nodiscard]] double time() const {
    double sum = 0.0;
    for (std::size_t i = 1; i < path_.size(); ++i) sum += time_s_(path_[i - 1], path_[i]);
    return sum;
  }
  [[nodiscard]] const std::vector<int>& path() const { return path_; }

 private:
  static constexpr double kGain = 1e-9;  ///< s; below it is rounding

  /// From place i to place j of the tour; the tour is open: nothing follows its last place.
  [[nodiscard]] double leg(std::size_t i, std::size_t j) const {
    return j < path_.size() ? time_s_(path_[i], path_[j]) : 0.0;
  }

  bool reverse_a_stretch() {
    const std::size_t n = path_.size();
    for (std::size_t i = 1; i + 1 < n; ++i) {
      double forth = 0.0, back = 0.0;  // inside the stretch i … j
      for (std::size_t j = i + 1; j < n; ++j) {
        forth += leg(j - 1, j);
        back += leg(j, j - 1);
        const double now = leg(i - 1, i) + forth + leg(j, j + 1);
        const double then = leg(i - 1, j) + back + leg(i, j + 1);
        if (then < now - kGain) {
          std::reverse(path_.begin() + static_cast<std::ptrdiff_t>(i),
                       path_.begin() + static_cast<std::ptrdiff_t>(j) + 1);
          return true;
        }
      }
    }
    return false;
  }

  /// A stretch of up to three places to elsewhere, either way round.
  bool move_a_stretch() {
    const double now = time();
    const std::size_t n = path_.size();
    for (std::size_t length = 1; length <= 3 && length < n; ++length) {
      for (std::size_t from = 1; from + length <= n; ++from) {
        std::vector<int> rest = path_;
        const auto at = [](std::vector<int>& v, std::size_t i) {
          return v.begin() + static_cast<std::ptrdiff_t>(i);
        };
        std::vector<int> stretch(at(path_, from), at(path_, from + length));
        rest.erase(at(rest, from), at(rest, from + length));
        const double removed = cut(rest, from, stretch);
        for (const bool turned : {false, true}) {
          if (turned) std::reverse(stretch.begin(), stretch.end());
          for (std::size_t to = 1; to <= rest.size(); ++to) {
            if (now + removed + joined(rest, to, stretch) < now - kGain) {
              rest.insert(at(rest, to), stretch.begin(), stretch.end());
              path_ = std::move(rest);
              return true;
            }
          }
        }
      }
    }
    return false;
  }

  [[nodiscard]] double inside(const std::vector<int>& stretch) const {
    double sum = 0.0;
    for (std::size_t i = 1; i < stretch.size(); ++i) sum += time_s_(stretch[i - 1], stretch[i]);
    return sum;
  }
  /// Change of time when `stretch` was cut out of before rest[at].
  [[nodiscard]] double cut(const std::vector<int>& rest, std::size_t at,
                           const std::vector<int>& stretch) const {
    double change = -time_s_(rest[at - 1], stretch.front()) - inside(stretch);
    if (at < rest.size()) {
      change += time_s_(rest[at - 1], rest[at]) - time_s_(stretch.back(), rest[at]);
    }
    return change;
  }
  [[nodiscard]] double joined(const std::vector<int>& rest, std::size_t at,
                              const std::vector<int>& stretch) const {
    return -cut(rest, at, stretch);
  }

  const Eigen::MatrixXd& time_s_;
  std::vector<int> path_;
};

std::vector<int> nearest_neighbours(const Eigen::MatrixXd& time_s, int first) {
  const int places = static_cast<int>(time_s.rows());
  std::vector<int> path{0, first};
  std::vector<bool> seen(places, false);
  seen[0] = seen[first] = true;
  while (static_cast<int>(path.size()) < places) {
    int nearest = -1;
    for (int p = 1; p < places; ++p) {
      if (!seen[p] && (nearest < 0 || time_s(path.back(), p) < time_s(path.back(), nearest))) {
        nearest = p;
      }
    }
    seen[nearest] = true;
    path.push_back(nearest);
  }
  return path;
}

/// +1 paying out, −1 reeling in, 0 too little to tell.
int direction(double from_m, double to_m) {
  if (std::abs(to_m - from_m) < kTurnOver_m) return 0;
  return to_m > from_m ? 1 : -1;
}

}  // namespace

VisitingOrder parse_visiting_order(const std::string& name) {
  for (const auto order : {VisitingOrder::least_time, VisitingOrder::random}) {
    if (name == to_string(order)) return order;
  }
  throw InputError("order: '" + name + "' is neither least-time nor random");
}

const char* to_string(VisitingOrder order) {
  return order == VisitingOrder::random ? "random" : "least-time";
}

Tour least_time_tour(const Eigen::MatrixXd& time_s) {
  if (time_s.rows() != time_s.cols() || time_s.rows() < 1) {
    throw InputError("tour: the matrix of times must be square, one row a place");
  }
  if (time_s.hasNaN()) throw InputError("tour: the matrix of times must not hold NaN");
  const int poses = static_cast<int>(time_s.rows()) - 1;
  if (poses == 0) return {{}, 0.0, true};
  if (poses <= kMostExact) return exact_tour(time_s);

  // Differences of times must stay numbers: no way is a very long way.
  const double longest =
      time_s.unaryExpr([](double t) { return std::isfinite(t) ? t : 0.0; }).maxCoeff();
  const double forbidden = 1e3 * (1.0 + longest) * poses;
  const Eigen::MatrixXd finite =
      time_s.unaryExpr([&](double t) { return std::isfinite(t) ? t : forbidden; });
  std::vector<int> firsts(poses);
  std::iota(firsts.begin(), firsts.end(), 1);
  std::stable_sort(firsts.begin(), firsts.end(),
                   [&](int a, int b) { return finite(0, a) < finite(0, b); });
  constexpr std::size_t kMostStarts = 12;
  firsts.resize(std::min(firsts.size(), kMostStarts));
  Tour best{{}, kInfinite, false};
  for (const int first : firsts) {
    LocalSearch search(finite, nearest_neighbours(finite, first));
    search.improve();
    if (search.time() >= best.time_s) continue;
    best.time_s = search.time();
    best.order.assign(search.path().begin() + 1, search.path().end());
  }
  for (int& p : best.order) --p;
  if (best.time_s >= forbidden) best.time_s = kInfinite;
  return best;
}

ApproachCoverage approach_coverage(const Eigen::MatrixXd& length_m, const std::vector<int>& order) {
  const Eigen::Index poses = length_m.rows() - 1, cables = length_m.cols();
  Eigen::MatrixXi seen = Eigen::MatrixXi::Zero(poses, cables);  // bit 1 reeling in, bit 2 out
  int place = 0;
  for (const int pose : order) {
    for (Eigen::Index c = 0; c < cables; ++c) {
      const int way = direction(length_m(place, c), length_m(pose + 1, c));
      if (way != 0) seen(pose, c) |= way > 0 ? 2 : 1;
    }
    place = pose + 1;
  }
  ApproachCoverage coverage;
  for (Eigen::Index p = 0; p < poses; ++p) {
    for (Eigen::Index c = 0; c < cables; ++c) {
      int ways = 0;
      for (Eigen::Index other = 1; other <= poses; ++other) {
        const int way = direction(length_m(other, c), length_m(p + 1, c));
        if (way != 0) ways |= way > 0 ? 2 : 1;
      }
      coverage.possible += ways == 3 ? 1 : 0;
      coverage.both += ways == 3 && seen(p, c) == 3 ? 1 : 0;
    }
  }
  return coverage;
}

std::vector<int> random_order(const Eigen::MatrixXd& length_m, int visits, std::uint64_t seed) {
  const int poses = static_cast<int>(length_m.rows()) - 1;
  if (visits < 1) throw InputError("random order: at least 1 visit of each pose");
  if (poses < 1) throw InputError("random order: no poses; give at least one");
  if (poses == 1 && visits > 1) {
    throw InputError("random order: a single pose cannot be visited anew: give more poses");
  }
  RandomNormal random(seed);
  const auto below = [&](std::size_t bound) {
    return std::min(static_cast<std::size_t>(random.uniform() * static_cast<double>(bound)),
                    bound - 1);
  };
  // Each round visits every pose once, so that a drift acts on every pose early and late.
  std::vector<int> order;
  for (int v = 0; v < visits; ++v) {
    const std::size_t begin = order.size();
    for (int p = 0; p < poses; ++p) order.push_back(p);
    for (std::size_t i = order.size() - 1; i > begin; --i) {
      std::swap(order[i], order[begin + below(i - begin + 1)]);
    }
    if (begin > 0 && order[begin] == order[begin - 1]) std::swap(order[begin], order[begin + 1]);
  }
  // Random swaps within a round; those are kept that lose no ground.
  const auto repeats = [&] {
    for (std::size_t i = 1; i < order.size(); ++i) {
      if (order[i] == order[i - 1]) return true;
    }
    return false;
  };
  constexpr std::size_t kTriesAPlace = 50;
  const std::size_t tries = visits > 1 ? kTriesAPlace * order.size() : 0;
  int best = approach_coverage(length_m, order).both;
  for (std::size_t i = 0; i < tries; ++i) {
    const std::size_t begin = below(visits) * poses;
    const std::size_t a = begin + below(poses), b = begin + below(poses);
    std::swap(order[a], order[b]);
    const int now = approach_coverage(length_m, order).both;
    if (now >= best && !repeats()) {
      best = now;
    } else {
      std::swap(order[a], order[b]);
    }
  }
  return order;
}

}  // namespace cdprcal
