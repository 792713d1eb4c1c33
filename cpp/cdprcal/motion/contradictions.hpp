// Which readings contradict the others, and for how long: a spike is left out, what stays is doubt.
#pragma once

#include <algorithm>
#include <cmath>
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
  /// off agrees with it some time: in the mean square it has to be far less off than it was.
  /// `told`: it is this reading that must be wrong, for all others agree. `starts`: there is no
  /// time to wait for.
  void note(std::size_t reading, bool contradicts, double misfit, bool agrees, bool told,
            double dt_s, bool starts = false) {
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
    if (told) count.told_s += dt_s;
    if (!agrees) {
      count.with_s = count.squares = 0.0;
      return;
    }
    count.told_s = 0.0;
    count.with_s += dt_s, count.squares += misfit * misfit * dt_s;
    if (count.with_s < kPatience_s) return;
    if (std::sqrt(count.squares / count.with_s) < kBack * count.most) {
      count = {};
    } else {
      count.with_s = count.squares = 0.0;
    }
  }
  [[nodiscard]] bool is_out(std::size_t reading) const { return of_[reading].out; }
  /// How many are out.
  [[nodiscard]] std::ptrdiff_t out() const { return std::ranges::count(of_, true, &Count::out); }
  /// Whether it is known for long that the reading is wrong, and no other: the pose is not in
  /// doubt.
  [[nodiscard]] bool is_told(std::size_t reading) const {
    return of_[reading].out && of_[reading].told_s >= kPatience_s;
  }
  [[nodiscard]] double against_s(std::size_t reading) const { return of_[reading].against_s; }
  void forget() { of_.assign(of_.size(), {}); }

 private:
  struct Count {
    double against_s = 0.0, with_s = 0.0, told_s = 0.0;
    double most = 0.0;     ///< misfit meanwhile
    double squares = 0.0;  ///< of misfits while it agrees, by time
    bool out = false;
  };
  std::vector<Count> of_;
};

}  // namespace cdprcal
