#include "cdprcal/calibration/elimination.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace cdprcal {
namespace {

using namespace lanes;

constexpr int kRow = 7;  // six derivatives and the residual

static_assert(kMostOffsets <= 32);

constexpr int packed(int row, int column) { return row * (row + 1) / 2 + column; }

/// One batch: kLanes poses side by side, each number an array of kLanes.
struct Batch {
  const double* rows;
  const double* by_offset;
  int offsets, slots;
  double damping;
  double* factor;  ///< [L 21 with 1/diagonal][y 6][D 6][Y 6 an offset]
  double* sums;
};
constexpr int kFactorY = 21, kFactorD = 27, kFactorOffsets = 33;
// Where the sums are: S (packed), then per offset g, raw g, raw diagonal, then three numbers.
constexpr int sums_size(int offsets) { return packed(offsets, 0) + 3 * offsets + 3; }

/// v ← L⁻¹ v, where h holds L with its diagonal inverted.
template <typename V>
CDPRCAL_INLINE void forward(const V* h, V* v) {
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b < a; ++b) v[a] -= h[packed(a, b)] * v[b];
    v[a] *= h[packed(a, a)];
  }
}

/// Lanes `first` … of a batch, as many as V has.
template <typename V>
CDPRCAL_INLINE void eliminate(const Batch& in, int first) {
  const Lanes<V> rows(in.rows, first), by_offsets(in.by_offset, first);
  const WritableLanes<V> factor(in.factor, first), sums(in.sums, first);
  V h[21] = {}, g[6] = {};
  V squares = {};
  for (int s = 0; s < in.slots; ++s) {
    V row[kRow];
    for (int a = 0; a < kRow; ++a) row[a] = rows[kRow * s + a];
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
  for (int j = 0; j < 6; ++j) {  // Cholesky
    V pivot = h[packed(j, j)];
    for (int k = 0; k < j; ++k) pivot -= h[packed(j, k)] * h[packed(j, k)];
    V inverse;
    for (int l = 0; l < count<V>; ++l) inverse[l] = 1.0 / std::sqrt(pivot[l]);
    h[packed(j, j)] = inverse;
    for (int i = j + 1; i < 6; ++i) {
      V value = h[packed(i, j)];
      for (int k = 0; k < j; ++k) value -= h[packed(i, k)] * h[packed(j, k)];
      h[packed(i, j)] = value * inverse;
    }
  }
  forward(h, g);  // y
  V decrease = {};
  for (int a = 0; a < 6; ++a) decrease += g[a] * g[a];
  for (int i = 0; i < 21; ++i) factor.set(i, h[i]);
  for (int a = 0; a < 6; ++a) factor.set(kFactorY + a, g[a]);

  const int per_offset = packed(in.offsets, 0);
  for (int k = 0; k < in.offsets; ++k) {
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
    for (int l = 0; l <= k; ++l) {
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

/// δ = −L⁻ᵀ (y + Y δo); written over y. Adds Σ δ² to norm and Σ D δ² to damping.
template <typename V>
CDPRCAL_INLINE void substitute(double* numbers, int offsets, const double* offset_step, int first,
                               double& norm, double& damping) {
  const WritableLanes<V> factor(numbers, first);
  V z[6];
  for (int a = 0; a < 6; ++a) z[a] = -factor[kFactorY + a];
  for (int k = 0; k < offsets; ++k) {
    for (int a = 0; a < 6; ++a) z[a] -= offset_step[k] * factor[kFactorOffsets + 6 * k + a];
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
    norm += squares[l];
    damping += damped[l];
  }
}

// The same bodies for each kind of processor; what it has is asked once.
#ifdef CDPRCAL_HAS_AVX
CDPRCAL_AVX512 void eliminate_avx512(const Batch& in) { eliminate<Vector8>(in, 0); }
CDPRCAL_AVX2 void eliminate_avx2(const Batch& in) {
  eliminate<Vector4>(in, 0);
  eliminate<Vector4>(in, 4);
}
CDPRCAL_AVX512 void substitute_avx512(double* factor, int offsets, const double* step, double& norm,
                                      double& damping) {
  substitute<Vector8>(factor, offsets, step, 0, norm, damping);
}
CDPRCAL_AVX2 void substitute_avx2(double* factor, int offsets, const double* step, double& norm,
                                  double& damping) {
  substitute<Vector4>(factor, offsets, step, 0, norm, damping);
  substitute<Vector4>(factor, offsets, step, 4, norm, damping);
}
#endif
void eliminate_anywhere(const Batch& in) {
  eliminate<Vector4>(in, 0);
  eliminate<Vector4>(in, 4);
}
void substitute_anywhere(double* factor, int offsets, const double* step, double& norm,
                         double& damping) {
  substitute<Vector4>(factor, offsets, step, 0, norm, damping);
  substitute<Vector4>(factor, offsets, step, 4, norm, damping);
}

struct Kernels {
  void (*eliminate)(const Batch&) = eliminate_anywhere;
  void (*substitute)(double*, int, const double*, double&, double&) = substitute_anywhere;
};

Kernels kernels() {
#ifdef CDPRCAL_HAS_AVX
  if (processor() == Processor::avx512) return {eliminate_avx512, substitute_avx512};
  if (processor() == Processor::avx2) return {eliminate_avx2, substitute_avx2};
#endif
  return {};
}

}  // namespace

CommonMatrix through_offsets(const Eigen::MatrixXd& information, const OffsetJacobian& by_initial) {
  const Eigen::Index offsets = by_initial.rows();
  CommonMatrix out(6 + offsets, 6 + offsets);
  out.bottomRightCorner(offsets, offsets) = information;
  // lazyProduct: these are too small for blocking to pay.
  out.bottomLeftCorner(offsets, 6) = information.lazyProduct(by_initial);
  out.topRightCorner(6, offsets) = out.bottomLeftCorner(offsets, 6).transpose();
  out.topLeftCorner<6, 6>() = by_initial.transpose().lazyProduct(out.bottomLeftCorner(offsets, 6));
  return out;
}

PoseElimination::PoseElimination(std::size_t poses, int offsets, bool steps_wanted)
    : offsets_(offsets),
      steps_wanted_(steps_wanted),
      factor_size_(static_cast<std::size_t>(kFactorOffsets + 6 * offsets)),
      rows_(buffer(static_cast<std::size_t>(kRow * (offsets + kMostRows)))),
      by_offset_(buffer(static_cast<std::size_t>(offsets))),
      sums_(buffer(static_cast<std::size_t>(sums_size(offsets)))),
      factors_(buffer(factor_size_ * (steps_wanted ? lanes::batches(poses) : 1))) {
  out_.information.resize(offsets, offsets);
  out_.gradient.resize(offsets);
  out_.raw_gradient.resize(offsets);
  out_.raw_diagonal.resize(offsets);
  begin(1.0);
}

void PoseElimination::begin(double damping) {
  damping_ = damping;
  added_ = batches_ = 0;
  std::fill_n(sums_.get(), sums_size(offsets_) * kLanes, 0.0);
}

void PoseElimination::add(const PoseRows& rows) {
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
  if (++added_ % kLanes == 0) eliminate_batch();
}

void PoseElimination::add_batch(int own_rows) {
  own_rows_ = own_rows;
  added_ += kLanes;
  eliminate_batch();
}

void PoseElimination::eliminate_batch() {
  double* const factor = factors_.get() + (steps_wanted_ ? batches_ : 0U) * factor_size_ * kLanes;
  kernels().eliminate({rows_.get(), by_offset_.get(), offsets_, offsets_ + own_rows_, damping_,
                       factor, sums_.get()});
  ++batches_;
}

const EliminatedSums& PoseElimination::finish() {
  static const PoseRows nothing{};  // H = 0, but λD > 0
  while (added_ % kLanes != 0) add(nothing);
  const auto sum = [&](int index) {
    const double* lanes = sums_.get() + index * kLanes;
    double total = 0.0;
    for (int l = 0; l < kLanes; ++l) total += lanes[l];
    return total;
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

PoseSteps PoseElimination::back_substitute(const Eigen::VectorXd& offset_step) {
  PoseSteps out;
  for (std::size_t b = 0; b < batches_; ++b) {
    kernels().substitute(factors_.get() + b * factor_size_ * kLanes, offsets_, offset_step.data(),
                         out.squared_norm, out.damping);
  }
  return out;
}

const double* PoseElimination::steps(std::size_t batch) const {
  return factors_.get() + (batch * factor_size_ + kFactorY) * kLanes;
}

}  // namespace cdprcal
