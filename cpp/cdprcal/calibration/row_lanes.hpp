// The rows of eight poses at once, in the form that the elimination takes them.
#pragma once

#include <array>
#include <vector>

#include "cdprcal/calibration/pose_lanes.hpp"
#include "cdprcal/calibration/residuals/term.hpp"

namespace cdprcal {

/// The equations of residuals/ for all measurements but the reference, in vectors: the same rows as
/// write_rows (row_lanes_test.cpp), a fraction of the time. Each row has a slot that is the same in
/// all poses; where a pose lacks the reading, its row is zero.
class RowLanes {
 public:
  /// Whether the equations of a problem can be written so: effects are models of one pose.
  static bool serve(const CalibrationProblem& problem);

  /// Gathers the readings. All three must outlive this.
  RowLanes(const CalibrationProblem& problem, const PoseCache& cache,
           const ReferenceReadings& reference);

  /// Takes over the present weights of the balance from the cache.
  void update_weights();
  /// The offsets o = m(ζ0) + e of what follows.
  void set_offsets(const PoseEvaluation& initial);
  /// Rows of a batch of poses: numbers [slot][6 derivatives, residual][lane], the offsets' slots
  /// first, then own_rows() others; derivatives by offset [offset][lane]. False when a pose has no
  /// valid kinematics, or no tensions.
  [[nodiscard]] bool write(std::size_t batch, const PoseLanes& poses, double* numbers,
                           double* by_offset) const;

  [[nodiscard]] int own_rows() const { return static_cast<int>(own_channel_.size()); }
  [[nodiscard]] std::size_t batches() const { return batches_; }
  /// Which channel a row belongs to.
  [[nodiscard]] Channel channel(int slot) const;

  /// Where things stand; −1 for what no pose has.
  struct Layout {
    int cables = 0;
    StaticsModel statics = StaticsModel::none;
    // Slots.
    int roll_pitch = -1, balance = -1, absolute_yaw = -1, direct_length = -1, position = -1;
    // Readings, [index][lane]: NaN where a pose has none. Weights are 1/σ.
    std::array<int, kChannels> reading{}, weight{};
    int tension = -1;
    int numbers = 0;  ///< a batch
  };

 private:
  int reserve(Channel channel, int readings, int own_rows);

  const CalibrationProblem& problem_;
  const PoseCache& cache_;
  const ReferenceReadings& reference_;
  std::size_t batches_;
  Layout layout_;
  std::vector<Channel> own_channel_;  ///< a row
  lanes::Buffer readings_;
  lanes::Buffer whitening_;  ///< [batch][6 × 6][lane], wrench statics only
  std::array<double, kMostOffsets> offsets_{};
};

}  // namespace cdprcal
