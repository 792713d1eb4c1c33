// The poses that a minimiser moves, eight side by side.
#pragma once

#include <algorithm>
#include <ranges>
#include <vector>

#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/lanes/vectors.hpp"

namespace cdprcal {

/// The indices, among so many poses, of those in a batch.
inline auto poses_of(std::size_t batch, std::size_t poses) {
  return std::views::iota(batch * lanes::kLanes,
                          std::min((batch + 1) * std::size_t{lanes::kLanes}, poses));
}

/// Poses as [batch][p 3, quaternion x y z w][lane]. Lanes beyond the last pose repeat it.
class PoseLanes {
 public:
  static constexpr int kNumbers = 7;

  explicit PoseLanes(std::size_t size);

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] Pose operator[](std::size_t pose) const;
  /// The last pose last: it fills the lanes behind it.
  void set(std::size_t pose, const Pose& value);
  [[nodiscard]] const double* batch(std::size_t index) const {
    return numbers_.get() + index * kNumbers * lanes::kLanes;
  }

  /// This batch: that of `from`, moved by world-frame twists, [6][lane] (plus of pose.hpp). Returns
  /// Σ (‖p‖² + 1) of `from`.
  double move(std::size_t batch, const PoseLanes& from, const double* twists);

 private:
  [[nodiscard]] std::size_t first(std::size_t pose) const {
    return (pose / lanes::kLanes) * kNumbers * lanes::kLanes + pose % lanes::kLanes;
  }

  std::size_t size_;
  lanes::Buffer numbers_;
};

}  // namespace cdprcal
