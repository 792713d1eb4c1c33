// Equilibria from many starts: the same one is kept once.
#pragma once

#include <vector>

#include "cdprcal/equilibria/equilibrium.hpp"

namespace cdprcal {

/// Collects equilibria; two are the same when they differ by less than 1e-6 of the robot's size
/// and 1e-6 rad.
class DistinctEquilibria {
 public:
  explicit DistinctEquilibria(const Robot& robot);
  /// `rank` orders equilibria of equal stability, the lowest first.
  void add(const EquilibriumResult& result, double rank);
  /// Stable ones first, by rank within each half.
  [[nodiscard]] std::vector<EquilibriumResult> sorted() const;

 private:
  struct Ranked {
    EquilibriumResult result;
    double rank;
  };
  double tolerance_m_;
  std::vector<Ranked> found_;
};

}  // namespace cdprcal
