// Which readings contradict the others, and for how long: a spike is left out, what stays is doubt.
#pragma once

#include <vector>

namespace cdprcal {

/// Keeps count, a reading each, sample after sample.
class Contradictions {
 public:
  explicit Contradictions(std::size_t readings) : against_s_(readings), with_s_(readings) {}

  /// Longer than this, and the pose may be wrong instead of the reading.
  static constexpr double kDoubt_s = 0.1;
  /// So long, and the reading does not count any more until it agrees for as long.
  static constexpr double kPatience_s = 0.5;

  void note(std::size_t reading, bool contradicts, bool agrees, double dt_s) {
    double &against = against_s_[reading], &with = with_s_[reading];
    if (contradicts) against += dt_s;
    if (!is_out(reading)) {
      if (!contradicts) against = 0.0;
      return;
    }
    with = agrees ? with + dt_s : 0.0;
    if (with >= kPatience_s) against = with = 0.0;
  }
  [[nodiscard]] bool is_out(std::size_t reading) const {
    return against_s_[reading] >= kPatience_s;
  }
  [[nodiscard]] bool is_doubted(std::size_t reading, double dt_s) const {
    return against_s_[reading] > (dt_s < kDoubt_s ? kDoubt_s : 1.5 * dt_s);
  }
  [[nodiscard]] double against_s(std::size_t reading) const { return against_s_[reading]; }
  void forget() {
    against_s_.assign(against_s_.size(), 0.0);
    with_s_.assign(with_s_.size(), 0.0);
  }

 private:
  std::vector<double> against_s_, with_s_;
};

}  // namespace cdprcal
