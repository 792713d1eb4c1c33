// The rows of eight poses at once, in the form that the elimination takes them.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "cdprcal/estimation/elimination.hpp"
#include "cdprcal/estimation/pose_lanes.hpp"
#include "cdprcal/estimation/residuals/term.hpp"
#include "cdprcal/estimation/row_batch.hpp"

namespace cdprcal {

/// The equations of residuals/ for all measurements but the reference, in vectors: the same rows as
/// write_rows (row_lanes_test.cpp), in a fraction of the time. Each row has a slot that is the same
/// in all poses; where a pose lacks the reading, its row is zero.
class RowLanes {
 public:
  /// Whether the equations of a problem can be written so: effects are models of one pose, and
  /// the wrench rows of the left inverse must be one a cable.
  static bool serve(const CalibrationProblem& problem);

  /// Gathers the readings. All three must outlive this.
  RowLanes(const CalibrationProblem& problem, const PoseCache& cache,
           const ReferenceReadings& reference);

  /// Takes over the present weights of the balance from the cache, where they are not yet here.
  void update_weights();
  /// The offsets o = m(ζ0) + e of what follows.
  void set_offsets(const PoseEvaluation& initial);
  /// Evaluates a batch of poses. False when a pose has no valid kinematics, or no tensions.
  bool evaluate(std::size_t batch, const PoseLanes& poses);
  /// Of the last batch, rows [slot][6 derivatives, residual][lane]: the offsets' slots first, then
  /// own_rows() others.
  [[nodiscard]] const double* rows() const { return rows_.get(); }
  /// Derivatives by the offsets, [offset][lane].
  [[nodiscard]] const double* by_offset() const { return by_offset_.get(); }

  /// Σ (F/σ)² of the last batch, of all rows or of a channel's.
  [[nodiscard]] double squared_residuals(std::optional<Channel> only = std::nullopt) const;
  /// The last batch's residuals in their own units: poses[1 + 8 · batch] and on.
  void residuals(std::size_t batch, std::vector<PoseResidual>& poses) const;

  /// Rows that carry a reading, over all poses.
  [[nodiscard]] int row_count() const { return row_count_; }
  [[nodiscard]] int own_rows() const { return static_cast<int>(own_channel_.size()); }
  [[nodiscard]] std::size_t batches() const { return batches_; }
  /// Which channel a row belongs to.
  [[nodiscard]] Channel channel(int slot) const;
  /// First slot of a channel; −1 where no pose reads it.
  [[nodiscard]] int slot(Channel channel) const { return layout_[channel].slot; }
  /// The slots that any pose reads, without those of a channel.
  [[nodiscard]] RowSlots slots(std::optional<Channel> without) const;

 private:
  /// Room for a channel's readings and weight, and for its rows unless they have offsets.
  void reserve(Channel channel, int readings, int own_rows);
  void gather();

  [[nodiscard]] int slot_count() const { return 2 * layout_.cables + 1 + own_rows(); }

  const CalibrationProblem& problem_;
  const PoseCache& cache_;
  const ReferenceReadings& reference_;
  std::size_t batches_;
  RowLayout layout_;
  int row_count_ = 0;
  std::vector<Channel> own_channel_;  ///< a row
  int weights_version_ = -1;
  lanes::Buffer readings_;
  lanes::Buffer whitening_;  ///< [batch][6 × 6][lane], wrench statics only
  std::array<double, kMostOffsets> offsets_{};
  lanes::Buffer rows_, by_offset_;
  lanes::Buffer values_;  ///< residuals before whitening, [slot][lane]; NaN where a pose has none
};

}  // namespace cdprcal
