#include "cdprcal/equilibria/distinct.hpp"

#include <algorithm>

#include "cdprcal/equilibria/starts.hpp"

namespace cdprcal {

bool same_equilibrium(const Robot& robot, const Pose& a, const Pose& b) {
  const Vector6 difference = minus(a, b);
  return difference.head<3>().norm() < 1e-6 * robot_size_m(robot) &&
         difference.tail<3>().norm() < 1e-6;
}

void DistinctEquilibria::add(const EquilibriumResult& result, double rank) {
  for (const Ranked& known : found_) {
    if (same_equilibrium(robot_, result.pose, known.result.pose)) return;
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
