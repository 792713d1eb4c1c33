#include "cdprcal/equilibria/distinct.hpp"

#include <algorithm>

#include "cdprcal/equilibria/starts.hpp"

namespace cdprcal {

DistinctEquilibria::DistinctEquilibria(const Robot& robot)
    : tolerance_m_(1e-6 * robot_size_m(robot)) {}

void DistinctEquilibria::add(const EquilibriumResult& result, double rank) {
  for (const Ranked& known : found_) {
    const Vector6 difference = minus(result.pose, known.result.pose);
    if (difference.head<3>().norm() < tolerance_m_ && difference.tail<3>().norm() < 1e-6) return;
  }
  found_.push_back({result, rank});
}

std::vector<EquilibriumResult> DistinctEquilibria::sorted() const {
  std::vector<Ranked> ranked = found_;
  std::stable_sort(ranked.begin(), ranked.end(), [](const Ranked& a, const Ranked& b) {
    if (a.result.stable != b.result.stable) return a.result.stable;
    return a.rank < b.rank;
  });
  std::vector<EquilibriumResult> results;
  results.reserve(ranked.size());
  for (const Ranked& r : ranked) results.push_back(r.result);
  return results;
}

}  // namespace cdprcal
