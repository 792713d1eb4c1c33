// Ways between all set-points of a plan: direct where the path is clear, else by way of others.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "cdprcal/parallel.hpp"
#include "cdprcal/planning/timing.hpp"

namespace cdprcal {

/// One transition.
struct Leg {
  int to = 0;  ///< place
  Timing timing;
};

/// All ways between places. A way that is not clear is replaced by the shortest one through other
/// places, stopping at each until the platform has settled. When some place cannot be reached at
/// all, set-points of a 3×3×3 grid around all places are added as places to pass through.
class LegTable {
 public:
  /// `checker` and `timer` must outlive the table; threads 0: one a core.
  LegTable(const PathChecker& checker, const TransitionTimer& timer, std::vector<SetPoint> places,
           int threads = 0, const ShareDone& progress = {});

  [[nodiscard]] bool stopped() const { return stopped_; }
  /// The places given, then those that were added.
  [[nodiscard]] const std::vector<SetPoint>& places() const { return places_; }
  /// Time [s] from place to place, the dwell at the second one included; infinite: no way. One row
  /// and column for each place given.
  [[nodiscard]] Eigen::MatrixXd time_s() const;
  /// The transitions from one place to another; empty when there is no way (or from == to).
  [[nodiscard]] std::vector<Leg> way(int from, int to) const;
  /// Why the direct way from one place to another is not taken; empty when it is.
  [[nodiscard]] const std::string& obstacle(int from, int to) const;

 private:
  void fill(std::size_t first, const ShareDone& progress);
  void find_detours();
  [[nodiscard]] bool connected() const;

  const PathChecker& checker_;
  const TransitionTimer& timer_;
  std::vector<SetPoint> places_;
  std::size_t given_;
  int threads_;
  bool stopped_ = false;
  /// A pair of places, by row and column.
  template <class T>
  struct Table {
    std::size_t size = 0;
    std::vector<T> cells;
    T& operator()(std::size_t i, std::size_t j) { return cells[i * size + j]; }
    const T& operator()(std::size_t i, std::size_t j) const { return cells[i * size + j]; }
    void grow(std::size_t to, const T& value);
  };
  Table<Timing> direct_;
  Table<std::string> obstacle_;
  Table<double> settled_s_;  ///< best way, without the time to measure
  Table<int> next_;          ///< first place on the best way; −1: none
};

}  // namespace cdprcal
