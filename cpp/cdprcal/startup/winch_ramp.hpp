// How fast commanded speeds may change: what all controllers of the winches share.
#pragma once

#include <algorithm>

#include "cdprcal/types.hpp"

namespace cdprcal {

/// From rest to the velocity limit: the drives' ramp.
inline constexpr double kFullSpeed_s = 0.2;

/// Where a run is on its leg or way, which comes to rest within kFullSpeed_s when the run ends.
class PlaceOnLeg {
 public:
  /// At a fraction s, which changes by s_by_time_1_s.
  void reset(double s, double s_by_time_1_s) {
    s_ = s;
    s_by_time_1_s_ = s_by_time_1_s;
    slows_by_1_s2_ = s_by_time_1_s / kFullSpeed_s;
  }
  void slow_down(double dt_s) {
    s_by_time_1_s_ = std::max(0.0, s_by_time_1_s_ - slows_by_1_s2_ * dt_s);
    s_ = std::min(1.0, s_ + s_by_time_1_s_ * dt_s);
  }
  [[nodiscard]] double s() const { return s_; }
  [[nodiscard]] double s_by_time_1_s() const { return s_by_time_1_s_; }

 private:
  double s_ = 0.0, s_by_time_1_s_ = 0.0, slows_by_1_s2_ = 0.0;
};

class WinchRamp {
 public:
  WinchRamp(int cable_count, double velocity_limit_m_s)
      : limit_m_s_(velocity_limit_m_s), commanded_m_s_(CableVector::Zero(cable_count)) {}

  void reset(const CableVector& velocity_m_s) {
    commanded_m_s_ = velocity_m_s;
    left_s_ = kFullSpeed_s;
  }
  [[nodiscard]] const CableVector& commanded_m_s() const { return commanded_m_s_; }
  /// Within the limit, and changing by no more than the limit in kFullSpeed_s.
  const CableVector& command(const CableVector& wanted_m_s, double dt_s) {
    const double change = limit_m_s_ * dt_s / kFullSpeed_s;
    for (Eigen::Index i = 0; i < wanted_m_s.size(); ++i) {
      const double now = commanded_m_s_[i];
      commanded_m_s_[i] = std::clamp(std::clamp(wanted_m_s[i], now - change, now + change),
                                     -limit_m_s_, limit_m_s_);
    }
    return commanded_m_s_;
  }
  /// The same, all cables by one share: what is wanted of them goes together.
  const CableVector& command_together(const CableVector& wanted_m_s, double dt_s) {
    const auto within = [](const CableVector& all, double limit) -> CableVector {
      const double most = all.cwiseAbs().maxCoeff();
      return most > limit ? CableVector(limit / most * all) : all;
    };
    const CableVector change = within(wanted_m_s, limit_m_s_) - commanded_m_s_;
    commanded_m_s_ += within(change, limit_m_s_ * dt_s / kFullSpeed_s);
    return commanded_m_s_;
  }
  /// From the velocity of the reset to a standstill in kFullSpeed_s, all cables by one share:
  /// speeds that belong to one motion of the platform still do so while it slows down.
  const CableVector& slow_down(double dt_s) {
    const double before_s = left_s_;
    left_s_ -= dt_s;
    if (left_s_ < 1e-9) left_s_ = 0.0;
    commanded_m_s_ *= before_s > 0.0 ? left_s_ / before_s : 0.0;
    return commanded_m_s_;
  }

 private:
  double limit_m_s_;
  CableVector commanded_m_s_;
  double left_s_ = kFullSpeed_s;  ///< of slowing down
};

}  // namespace cdprcal
