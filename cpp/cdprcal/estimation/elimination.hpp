// The measurement poses leave the normal equations (Schur complement), eight at a time.
#pragma once

#include <array>

#include "cdprcal/estimation/residuals/term.hpp"
#include "cdprcal/lanes/vectors.hpp"

namespace cdprcal {

/// Unknowns that nothing measures: the diagonal of JᵀJ counts at least so much in the damping.
inline constexpr double kLeastDiagonal = 1e-6;

/// What is left when the poses are gone: ζ0's six unknowns and the reference errors.
inline constexpr int kMostCommon = 6 + kMostOffsets;
using CommonMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                                   kMostCommon, kMostCommon>;
using OffsetMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                                   kMostOffsets, kMostOffsets>;
/// Information about the offsets as information about ζ0, and `with_errors` about e as well: chain
/// rule through o = m(ζ0) + e.
CommonMatrix through_offsets(const OffsetMatrix& information, const OffsetJacobian& by_initial,
                             bool with_errors);

/// What the eliminated poses say about the offsets o = m(ζ0) + e. With H, C and g a pose's blocks
/// of JᵀJ, JᵀJ_o and Jᵀr, and D the diagonal of H:
struct EliminatedSums {
  OffsetMatrix information;   ///< Σ J_oᵀJ_o − Cᵀ (H + λD)⁻¹ C
  OffsetVector gradient;      ///< Σ J_oᵀr − Cᵀ (H + λD)⁻¹ g
  OffsetVector raw_gradient;  ///< Σ J_oᵀr
  OffsetVector raw_diagonal;  ///< Σ of squares of J_o's columns
  double cost = 0.0;          ///< ½ Σ r²
  double decrease = 0.0;      ///< ½ Σ gᵀ (H + λD)⁻¹ g
  double largest_gradient = 0.0;
};

/// What moving the offsets moves in the poses.
struct PoseSteps {
  double squared_norm = 0.0;  ///< Σ ‖δ‖²
  double damping = 0.0;       ///< Σ δᵀDδ
};

/// Which slots of a batch of rows count: indices of offsets, then of rows without offset.
struct RowSlots {
  std::array<int, kMostOffsets + kMostRows> index{};
  int count = 0;
  int offsets = 0;  ///< so many of them are offsets
};

/// Adds up poses one after another; keeps their factors for the way back. The arithmetic is that of
/// a Cholesky factor a pose, done for eight poses side by side: the widest vectors that the
/// processor has do it (AVX-512, AVX2, or what every x86-64 has), so the last bits of results may
/// differ between kinds of processors, never between runs on one.
class PoseElimination {
 public:
  /// Keeps factors when `steps_wanted`: (33 + 6 · offsets) numbers a pose.
  PoseElimination(std::size_t poses, int offsets, bool steps_wanted);

  /// Starts anew with the damping λ > 0 of H + λD; then either add() or add_batch().
  void begin(double damping);
  /// The next pose's rows. Rows without offset are its own; each offset occurs once at most.
  void add(const PoseRows& rows);
  /// The same for batches, of whose rows these slots count; to outlive the sums.
  void begin(double damping, const RowSlots& slots);
  /// The next eight poses: rows [slot][6 derivatives, residual][lane], the slots of the offsets
  /// first, and by_offset [offset][lane] (RowLanes). Lanes without a pose have rows of zeros.
  void add_batch(const double* rows, const double* by_offset);
  /// The sums over all poses added. Not finite when a pose has no positive definite H + λD.
  const EliminatedSums& finish();

  /// Steps of all poses for a step of the offsets.
  PoseSteps back_substitute(const OffsetVector& offset_step);
  /// Those of a batch, world-frame twists: [6][lane].
  [[nodiscard]] const double* steps(std::size_t batch) const;

 private:
  [[nodiscard]] const RowSlots& slots() const { return chosen_ != nullptr ? *chosen_ : every_; }
  void eliminate_batch(const double* rows, const double* by_offset, int count);

  int offsets_;
  bool steps_wanted_;
  std::size_t factor_size_;  ///< numbers a batch
  double damping_ = 0.0;
  std::size_t added_ = 0, batches_ = 0;
  int own_rows_ = 0;  ///< most rows without offset in this batch, one pose after another
  RowSlots every_;    ///< slot there can be
  const RowSlots* chosen_ = nullptr;  ///< nullptr: every_
  lanes::Buffer rows_;                ///< of this batch: [slot][6 derivatives, residual][lane]
  lanes::Buffer by_offset_;           ///< [offset][lane]
  lanes::Buffer sums_;                ///< and behind them factors_
  double* factors_;                   ///< one batch after another; the steps end in them
  EliminatedSums out_;
};

}  // namespace cdprcal
