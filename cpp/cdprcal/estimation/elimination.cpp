#include "cdprcal/estimation/elimination.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "cdprcal/estimation/row_batch.hpp"
#include "cdprcal/lanes/algebra.hpp"
#include "cdprcal/lanes/processor.hpp"

namespace cdprcal {
namespace {

using namespace lanes;

static_assert(kMostOffsets <= 32);

/// One batch: kLanes poses side by side, each number an array of kLanes.
struct Batch {
  const double* rows;
  const double* by_offset;
  int offsets;
  const int* slot;  ///< those that count, offsets first
  int present_offsets, slots;
  double damping;
  double* factor;  ///< [L 21 with 1/diagonal][y 6][D 6][Y 6 an offset]
  double* sums;
};
constexpr int kFactorY = 21, kFactorD = 27, kFactorOffsets = 33;
// Where the sums are: S (packed), then per offset g, raw g, raw diagonal, then three numbers.
constexpr int sums_size(int offsets) { return packed(offsets, 0) + 3 * offsets + 3; }

/// Lanes `first` … of a batch.
template <typename Kind, typename V = typename Kind::V>
CDPRCAL_INLINE void eliminate(const Batch& in, int first) {
  const Lanes<V> rows(in.rows, first), by_offsets(in.by_offset, first);
  const WritableLanes<V> factor(in.factor, first), sums(in.sums, first);
  V h[21] = {}, g[6] = {};
  V squares = {};
  for (int s = 0; s < in.slots; ++s) {
    V row[kRow];
    for (int a = 0; a < kRow; ++a) row[a] = rows[kRow * in.slot[s] + a];
    squares += row[6] * row[6];
    for (int a = 0; a < 6; ++a) {
      g[a] += row[a] * row[6];
      for (int b = 0; b <= a; ++b) h[packed(a, b)] += row[a] * row[b];
    }
  }
  V steepest = {};
  for (int a = 0; a < 6; ++a) {
    V& diagonal = h[packed(a, a)];
    const V least = V{} + kLeastDiagonal;
    const V scale = diagonal > least ? diagonal : least;
    factor.set(kFactorD + a, scale);
    diagonal += in.damping * scale;
    const V magnitude = g[a] < V{} ? -g[a] : g[a];
    steepest = magnitude > steepest ? magnitude : steepest;
  }
  cholesky<Kind>(h);
  forward(h, g);  // y
  V decrease = {};
  for (int a = 0; a < 6; ++a) decrease += g[a] * g[a];
  for (int i = 0; i < 21; ++i) factor.set(i, h[i]);
  for (int a = 0; a < 6; ++a) factor.set(kFactorY + a, g[a]);

  const int per_offset = packed(in.offsets, 0);
  for (int i = 0; i < in.present_offsets; ++i) {
    const int k = in.slot[i];
    const V by_offset = by_offsets[k];
    V y[6];
    for (int a = 0; a < 6; ++a) y[a] = by_offset * rows[kRow * k + a];
    forward(h, y);
    const V raw = by_offset * rows[kRow * k + 6];
    V reduced = raw;
    for (int a = 0; a < 6; ++a) {
      reduced -= y[a] * g[a];
      factor.set(kFactorOffsets + 6 * k + a, y[a]);
    }
    sums.add(per_offset + k, reduced);
    sums.add(per_offset + in.offsets + k, raw);
    sums.add(per_offset + 2 * in.offsets + k, by_offset * by_offset);
    sums.add(packed(k, k), by_offset * by_offset);
    for (int j = 0; j <= i; ++j) {
      const int l = in.slot[j];
      V product = {};
      for (int a = 0; a < 6; ++a) product -= y[a] * factor[kFactorOffsets + 6 * l + a];
      sums.add(packed(k, l), product);
    }
  }
  const int last = per_offset + 3 * in.offsets;
  sums.add(last, squares);
  sums.add(last + 1, decrease);
  const V before = sums[last + 2];
  sums.set(last + 2, steepest > before ? steepest : before);
}

/// The way back of one batch.
struct Substitution {
  double* factor;
  const int* offset;  ///< those that count
  int offsets;
  const double* offset_step;
  double& norm;     ///< Σ δ² is added
  double& damping;  ///< Σ D δ² is added
};

/// δ = −L⁻ᵀ (y + Y δo); written over y.
template <typename Kind, typename V = typename Kind::V>
CDPRCAL_INLINE void substitute(const Substitution& in, int first) {
  const WritableLanes<V> factor(in.factor, first);
  V z[6];
  for (int a = 0; a < 6; ++a) z[a] = -factor[kFactorY + a];
  for (int i = 0; i < in.offsets; ++i) {
    const int k = in.offset[i];
    for (int a = 0; a < 6; ++a) z[a] -= in.offset_step[k] * factor[kFactorOffsets + 6 * k + a];
  }
  V squares = {}, damped = {};
  for (int a = 5; a >= 0; --a) {
    for (int b = a + 1; b < 6; ++b) z[a] -= factor[packed(b, a)] * z[b];
    z[a] *= factor[packed(a, a)];
    factor.set(kFactorY + a, z[a]);
    squares += z[a] * z[a];
    damped += factor[kFactorD + a] * z[a] * z[a];
  }
  for (int l = 0; l < count<V>; ++l) {
    in.norm += squares[l];
    in.damping += damped[l];
  }
}

/// BᵀSB and SB of the offsets' information S; the lanes are the six of ζ0.
struct Through {
  const double* by_initial;   ///< [offset][lane]
  const double* information;  ///< symmetric, column by column
  Eigen::Index stride;        ///< from column to column
  int offsets;
  double* half;     ///< SB, [offset][lane]
  double* initial;  ///< BᵀSB, [six][lane]
};

template <typename Kind, typename V = typename Kind::V>
CDPRCAL_INLINE void through(const Through& in, int first) {
  const Lanes<V> by_initial(in.by_initial, first);
  const WritableLanes<V> half(in.half, first), initial(in.initial, first);
  V sums[6] = {};
  for (int k = 0; k < in.offsets; ++k) {
    const double* const column = in.information + k * in.stride;
    V row = {};
    for (int l = 0; l < in.offsets; ++l) row += column[l] * by_initial[l];
    half.set(k, row);
    for (int a = 0; a < 6; ++a) sums[a] += in.by_initial[k * kLanes + a] * row;
  }
  for (int a = 0; a < 6; ++a) initial.set(a, sums[a]);
}

CDPRCAL_DEFINE_FOR_PROCESSORS(through_lanes, through, Through)
CDPRCAL_DEFINE_FOR_PROCESSORS(eliminate_lanes, eliminate, Batch)
CDPRCAL_DEFINE_FOR_PROCESSORS(substitute_lanes, substitute, Substitution)

}  // namespace

CommonMatrix through_offsets(const OffsetMatrix& information, const OffsetJacobian& by_initial,
                             bool with_errors) {
  const Eigen::Index offsets = by_initial.rows();
  using Sixes =
      Eigen::Matrix<double, kLanes, Eigen::Dynamic, Eigen::ColMajor, kLanes, kMostOffsets>;
  Sixes six(kLanes, offsets), half(kLanes, offsets);
  six.topRows<6>() = by_initial.transpose();
  six.bottomRows<kLanes - 6>().setZero();
  Eigen::Matrix<double, kLanes, 6> initial;
  through_lanes({six.data(), information.data(), information.outerStride(),
                 static_cast<int>(offsets), half.data(), initial.data()});
  if (!with_errors) return initial.topRows<6>();
  CommonMatrix out(6 + offsets, 6 + offsets);
  out.topLeftCorner<6, 6>() = initial.topRows<6>();
  out.topRightCorner(6, offsets) = half.topRows<6>();
  out.bottomLeftCorner(offsets, 6) = half.topRows<6>().transpose();
  out.bottomRightCorner(offsets, offsets) = information;
  return out;
}

PoseElimination::PoseElimination(std::size_t poses, int offsets, bool steps_wanted)
    : offsets_(offsets),
      steps_wanted_(steps_wanted),
      factor_size_(static_cast<std::size_t>(kFactorOffsets + 6 * offsets)),
      sums_(buffer(static_cast<std::size_t>(sums_size(offsets)) +
                   factor_size_ * (steps_wanted ? lanes::batches(poses) : 1))),
      factors_(sums_.get() + sums_size(offsets) * kLanes) {
  every_.offsets = offsets;
  every_.count = offsets + kMostRows;
  std::iota(every_.index.begin(), every_.index.end(), 0);
  out_.information.resize(offsets, offsets);
  out_.gradient.resize(offsets);
  out_.raw_gradient.resize(offsets);
  out_.raw_diagonal.resize(offsets);
}

void PoseElimination::begin(double damping) {
  chosen_ = nullptr;
  damping_ = damping;
  added_ = batches_ = 0;
  std::fill_n(sums_.get(), sums_size(offsets_) * kLanes, 0.0);
}

void PoseElimination::begin(double damping, const RowSlots& slots) {
  begin(damping);
  chosen_ = &slots;
}

void PoseElimination::add(const PoseRows& rows) {
  if (!rows_) {
    rows_ = buffer(static_cast<std::size_t>(kRow) * static_cast<std::size_t>(offsets_ + kMostRows));
    by_offset_ = buffer(static_cast<std::size_t>(offsets_));
  }
  const auto lane = static_cast<int>(added_ % kLanes);
  if (lane == 0) own_rows_ = 0;
  const auto clear = [&](int slot) {
    for (int a = 0; a < kRow; ++a) rows_[(kRow * slot + a) * kLanes + lane] = 0.0;
  };
  std::uint32_t present = 0;  // offsets
  int own = 0;
  for (int r = 0; r < rows.count; ++r) {
    const auto row = static_cast<std::size_t>(r);
    int slot = rows.offset[row];
    if (slot < 0) {
      slot = offsets_ + own++;
      if (own > own_rows_) {  // lanes before this one have no such row
        std::fill_n(rows_.get() + kRow * slot * kLanes, kRow * kLanes, 0.0);
        own_rows_ = own;
      }
    } else {
      present |= 1U << slot;
      by_offset_[slot * kLanes + lane] = rows.by_offset[row];
    }
    double* const out = rows_.get() + kRow * slot * kLanes + lane;
    for (int a = 0; a < 6; ++a) out[a * kLanes] = rows.own[row][static_cast<std::size_t>(a)];
    out[6 * kLanes] = rows.residual[row];
  }
  for (int slot = offsets_ + own; slot < offsets_ + own_rows_; ++slot) clear(slot);
  for (int k = 0; k < offsets_; ++k) {
    if ((present >> k & 1U) != 0U) continue;
    clear(k);
    by_offset_[k * kLanes + lane] = 0.0;
  }
  if (++added_ % kLanes == 0) {
    eliminate_batch(rows_.get(), by_offset_.get(), offsets_ + own_rows_);
  }
}

void PoseElimination::add_batch(const double* rows, const double* by_offset) {
  added_ += kLanes;
  eliminate_batch(rows, by_offset, slots().count);
}

void PoseElimination::eliminate_batch(const double* rows, const double* by_offset, int count) {
  double* const factor = factors_ + (steps_wanted_ ? batches_ : 0U) * factor_size_ * kLanes;
  eliminate_lanes({rows, by_offset, offsets_, slots().index.data(), slots().offsets, count,
                   damping_, factor, sums_.get()});
  ++batches_;
}

const EliminatedSums& PoseElimination::finish() {
  static const PoseRows nothing{};  // H = 0, but λD > 0
  while (added_ % kLanes != 0) add(nothing);
  const auto sum = [&](int index) {
    return Eigen::Map<const Eigen::Matrix<double, kLanes, 1>, Eigen::Aligned64>(sums_.get() +
                                                                                index * kLanes)
        .sum();
  };
  const int per_offset = packed(offsets_, 0);
  for (int k = 0; k < offsets_; ++k) {
    for (int l = 0; l <= k; ++l) {
      out_.information(k, l) = out_.information(l, k) = sum(packed(k, l));
    }
    out_.gradient[k] = sum(per_offset + k);
    out_.raw_gradient[k] = sum(per_offset + offsets_ + k);
    out_.raw_diagonal[k] = sum(per_offset + 2 * offsets_ + k);
  }
  const int last = per_offset + 3 * offsets_;
  out_.cost = 0.5 * sum(last);
  out_.decrease = 0.5 * sum(last + 1);
  const double* const steepest = sums_.get() + (last + 2) * kLanes;
  out_.largest_gradient = *std::max_element(steepest, steepest + kLanes);
  return out_;
}

PoseSteps PoseElimination::back_substitute(const OffsetVector& offset_step) {
  PoseSteps out;
  for (std::size_t b = 0; b < batches_; ++b) {
    substitute_lanes({factors_ + b * factor_size_ * kLanes, slots().index.data(), slots().offsets,
                      offset_step.data(), out.squared_norm, out.damping});
  }
  return out;
}

const double* PoseElimination::steps(std::size_t batch) const {
  return factors_ + (batch * factor_size_ + kFactorY) * kLanes;
}

}  // namespace cdprcal
