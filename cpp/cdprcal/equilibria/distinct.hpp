// Equilibria from many starts: the same one is kept once.
#pragma once

#include <vector>

#include "cdprcal/equilibria/equilibrium.hpp"

namespace cdprcal {

/// Whether two poses differ by less than 1e-6 of the robot's size and 1e-6 rad.
bool same_equilibrium(const Robot& robot, const Pose& a, const Pose& b);

/// Collects distinct equilibria.
class DistinctEquilibria {
 public:
  explicit DistinctEquilibria(const Robot& robot) : robot_(robot) {}
  /// `rank` orders equilibria of equal stability, the lowest first.
  void add(const EquilibriumResult& result, double rank);
  /// Stable ones first, by rank within each half.
  [[nodiscard]] std::vector<EquilibriumResult> sorted() const;

 private:
  struct Ranked {
    EquilibriumResult result;
    double rank;
  };
  const Robot& robot_;
  std::vector<Ranked> found_;
};

}  // namespace cdprcal
