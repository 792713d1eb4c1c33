// Which readings contradict the others, and for how long: a spike is left out, what stays is doubt.
#pragma once

#include <algorithm>
#include <vector>

namespace cdprcal {

/// Keeps count, a reading each, sample after sample.
class Contradictions {
 public:
  explicit Contradictions(std::size_t readings) : of_(readings) {}

  /// Longer than this, and the pose may be wrong instead of the reading, which does not count.
  static constexpr double kDoubt_s = 0.1;
  /// Until it agrees for so long.
  static constexpr double kPatience_s = 0.5;

  /// `misfit`: by how much. Without the reading the pose is known less and less, and what is so far
  /// off agrees with it some time: it has to be far less off than it was.
  /// `starts`: there is no time to wait for.
  void note(std::size_t reading, bool contradicts, double misfit, bool agrees, double dt_s,
            bool starts = false) {
    constexpr double kBack = 0.3;
    Count& count = of_[reading];
    if (contradicts) {
      count.against_s += starts ? kPatience_s : dt_s;
      count.most = std::max(count.most, misfit);
      if (starts || count.against_s > std::max(kDoubt_s, 1.5 * dt_s)) count.out = true;
    }
    if (!count.out) {
      if (!contradicts) count.against_s -= dt_s;
      if (!(count.against_s > 0.0)) count = {};
      return;
    }
    count.with_s = agrees && misfit < kBack * count.most ? count.with_s + dt_s : 0.0;
    if (count.with_s >= kPatience_s) count = {};
  }
  [[nodiscard]] bool is_out(std::size_t reading) const { return of_[reading].out; }
  [[nodiscard]] double against_s(std::size_t reading) const { return of_[reading].against_s; }
  void forget() { of_.assign(of_.size(), {}); }

 private:
  struct Count {
    double against_s = 0.0, with_s = 0.0;
    double most = 0.0;  ///< misfit meanwhile
    bool out = false;
  };
  std::vector<Count> of_;
};

}  // namespace cdprcal
