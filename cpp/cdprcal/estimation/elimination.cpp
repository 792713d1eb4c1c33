#include "cdprcal/estimation/elimination.hpp"

#include <algorithm>
#include <cmath>

#include "cdprcal/lanes/algebra.hpp"
#include "cdprcal/lanes/processor.hpp"

namespace cdprcal {
namespace {

using namespace lanes;

/// One batch: kLanes poses side by side, each number an array of kLanes.
struct PoseBatch {
  const double* rows;
  const double* by_offset;
  const double* by_effect;
  int offsets, columns;
  const int* slot;  ///< those that count, offsets first
  int present_offsets, slots;
  double damping;
  const double* across;  ///< what guides prevent, packed; null where nothing is guided
  double* factor;        ///< [L 21 with 1/diagonal][y 6][D 6][Y 6 an unknown]
  double* sums;
};
constexpr int kFactorY = 21, kFactorD = 27, kFactorUnknowns = 33;
// Where the sums are: S (packed), then per unknown g, raw g, raw diagonal, then three numbers.
constexpr int sums_size(int unknowns) { return packed(unknowns, 0) + 3 * unknowns + 3; }

template <typename V>
CDPRCAL_INLINE bool is_zero(const V& v) {
  for (int l = 0; l < count<V>; ++l) {
    if (v[l] != 0.0) return false;
  }
  return true;
}

/// Lanes `first` … of a batch.
template <typename Kind, typename V = typename Kind::V>
CDPRCAL_INLINE void eliminate(const PoseBatch& in, int first) {
  const Lanes<V> rows(in.rows, first), by_offsets(in.by_offset, first),
      by_effects(in.by_effect, first);
  const WritableLanes<V> factor(in.factor, first), sums(in.sums, first);
  const int unknowns = in.offsets + in.columns;
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
  // A damping that is not along the guides would step off them, and of no damping at all H has no
  // factor: a stiffness of one across, whose logarithm is none.
  for (int i = 0; in.across != nullptr && i < 21; ++i) h[i] += in.across[i];
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

  const int per_unknown = packed(unknowns, 0);
  const auto add = [&](int u, V(&y)[6], const V& raw, const V& square) CDPRCAL_INLINE_LAMBDA {
    forward(h, y);
    V reduced = raw, own = square;
    for (int a = 0; a < 6; ++a) {
      reduced -= y[a] * g[a];
      own -= y[a] * y[a];
      factor.set(kFactorUnknowns + 6 * u + a, y[a]);
    }
    sums.add(per_unknown + u, reduced);
    sums.add(per_unknown + unknowns + u, raw);
    sums.add(per_unknown + 2 * unknowns + u, square);
    sums.add(packed(u, u), own);
  };
  const auto shared = [&](const V(&y)[6], int u) CDPRCAL_INLINE_LAMBDA {
    V product = {};
    for (int a = 0; a < 6; ++a) product -= y[a] * factor[kFactorUnknowns + 6 * u + a];
    return product;
  };
  for (int i = 0; i < in.present_offsets; ++i) {
    const int k = in.slot[i];
    const V by_offset = by_offsets[k];
    V y[6];
    for (int a = 0; a < 6; ++a) y[a] = by_offset * rows[kRow * k + a];
    add(k, y, by_offset * rows[kRow * k + 6], by_offset * by_offset);
    for (int j = 0; j < i; ++j) sums.add(packed(k, in.slot[j]), shared(y, in.slot[j]));
  }
  for (int k = 0; k < in.columns; ++k) {
    const int u = in.offsets + k;
    V y[6] = {}, raw = {}, square = {};
    // Most values bear on few rows.
    int own[kMostRows], count_own = 0;
    for (int s = 0; s < in.slots; ++s) {
      const V by_effect = by_effects[in.slot[s] * in.columns + k];
      if (is_zero(by_effect)) continue;
      own[count_own++] = in.slot[s];
      for (int a = 0; a < 6; ++a) y[a] += by_effect * rows[kRow * in.slot[s] + a];
      raw += by_effect * rows[kRow * in.slot[s] + 6];
      square += by_effect * by_effect;
    }
    add(u, y, raw, square);
    for (int i = 0; i < in.present_offsets; ++i) {
      const int o = in.slot[i];
      sums.add(packed(u, o), by_offsets[o] * by_effects[o * in.columns + k] + shared(y, o));
    }
    for (int l = 0; l < k; ++l) {
      V product = shared(y, in.offsets + l);
      for (int s = 0; s < count_own; ++s) {
        const int at = own[s] * in.columns;
        product += by_effects[at + k] * by_effects[at + l];
      }
      sums.add(packed(u, in.offsets + l), product);
    }
  }
  const int last = per_unknown + 3 * unknowns;
  sums.add(last, squares);
  sums.add(last + 1, decrease);
  const V before = sums[last + 2];
  sums.set(last + 2, steepest > before ? steepest : before);
}

/// The way back of one batch.
struct Substitution {
  double* factor;
  int offsets, columns;
  const int* slot;  ///< of offsets that count
  int present_offsets;
  const double* step;
  double& norm;     ///< Σ δ² is added
  double& damping;  ///< Σ D δ² is added
};

/// δ = −L⁻ᵀ (y + Y δc); written over y.
template <typename Kind, typename V = typename Kind::V>
CDPRCAL_INLINE void substitute(const Substitution& in, int first) {
  const WritableLanes<V> factor(in.factor, first);
  V z[6];
  for (int a = 0; a < 6; ++a) z[a] = -factor[kFactorY + a];
  const auto take = [&](int u) CDPRCAL_INLINE_LAMBDA {
    for (int a = 0; a < 6; ++a) z[a] -= in.step[u] * factor[kFactorUnknowns + 6 * u + a];
  };
  for (int i = 0; i < in.present_offsets; ++i) take(in.slot[i]);
  for (int k = 0; k < in.columns; ++k) take(in.offsets + k);
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

/// What the fit leaves of the rows of one batch.
struct LeftOver {
  const PoseBatch& batch;
  const double* covariance;  ///< of the common unknowns, symmetric, column by column
  Eigen::Index stride;
  double* scratch;  ///< [unknown][lane]
  double* out;
};

template <typename Kind, typename V = typename Kind::V>
CDPRCAL_INLINE void left_over_of(const LeftOver& in, int first) {
  const PoseBatch& b = in.batch;
  const Lanes<V> rows(b.rows, first), by_offsets(b.by_offset, first),
      by_effects(b.by_effect, first), factor(b.factor, first);
  const WritableLanes<V> lifted(in.scratch, first), out(in.out, first);
  for (int s = 0; s < b.slots; ++s) {
    const int slot = b.slot[s];
    V j[6];
    for (int a = 0; a < 6; ++a) {  // L⁻¹ of the row
      j[a] = rows[kRow * slot + a];
      for (int c = 0; c < a; ++c) j[a] -= factor[packed(a, c)] * j[c];
      j[a] *= factor[packed(a, a)];
    }
    V residual = rows[kRow * slot + 6], freedom = V{} + 1.0;
    for (int a = 0; a < 6; ++a) {
      residual -= j[a] * factor[kFactorY + a];
      freedom -= j[a] * j[a];
    }
    const auto lift = [&](int u, V value) CDPRCAL_INLINE_LAMBDA {
      for (int a = 0; a < 6; ++a) value -= j[a] * factor[kFactorUnknowns + 6 * u + a];
      lifted.set(u, value);
      const double* const column = in.covariance + u * in.stride;
      V sum = {};
      for (int i = 0; i < b.present_offsets && b.slot[i] < u; ++i) {
        sum += column[b.slot[i]] * lifted[b.slot[i]];
      }
      for (int v = b.offsets; v < u; ++v) sum += column[v] * lifted[v];
      freedom -= value * (2.0 * sum + column[u] * value);
    };
    for (int i = 0; i < b.present_offsets; ++i) {
      const int o = b.slot[i];
      lift(o, o == slot ? by_offsets[o] : V{});
    }
    for (int k = 0; k < b.columns; ++k) lift(b.offsets + k, by_effects[slot * b.columns + k]);
    out.set(2 * slot, residual);
    out.set(2 * slot + 1, freedom);
  }
}

CDPRCAL_DEFINE_FOR_PROCESSORS(eliminate_lanes, eliminate, PoseBatch)
CDPRCAL_DEFINE_FOR_PROCESSORS(substitute_lanes, substitute, Substitution)
CDPRCAL_DEFINE_FOR_PROCESSORS(left_over_lanes, left_over_of, LeftOver)

}  // namespace

PoseElimination::PoseElimination(std::size_t poses, int offsets, int columns, bool steps_wanted,
                                 const Matrix6& across)
    : offsets_(offsets),
      columns_(columns),
      unknowns_(offsets + columns),
      steps_wanted_(steps_wanted),
      factor_size_(static_cast<std::size_t>(kFactorUnknowns + 6 * unknowns_)),
      across_(across),
      sums_(buffer(static_cast<std::size_t>(sums_size(unknowns_)) +
                   factor_size_ *
                       (steps_wanted ? std::max<std::size_t>(1, lanes::batches(poses)) : 1))),
      factors_(sums_.get() + sums_size(unknowns_) * kLanes) {
  out_.information.setZero(unknowns_, unknowns_);
  out_.gradient.setZero(unknowns_);
  out_.raw_gradient.setZero(unknowns_);
  out_.raw_diagonal.setZero(unknowns_);
  if (across.isZero()) return;
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b <= a; ++b) stiffness_.push_back(across(a, b));
  }
}

void PoseElimination::begin(double damping, const std::vector<int>& slots) {
  slots_ = &slots;
  present_offsets_ = static_cast<int>(
      std::count_if(slots.begin(), slots.end(), [&](int slot) { return slot < offsets_; }));
  damping_ = damping;
  batches_ = 0;
  std::fill_n(sums_.get(), sums_size(unknowns_) * kLanes, 0.0);
}

void PoseElimination::add(const double* rows, const double* by_offset, const double* by_effect) {
  double* const factor = factors_ + (steps_wanted_ ? batches_ : 0U) * factor_size_ * kLanes;
  eliminate_lanes({rows, by_offset, by_effect, offsets_, columns_, slots_->data(), present_offsets_,
                   static_cast<int>(slots_->size()), damping_,
                   stiffness_.empty() ? nullptr : stiffness_.data(), factor, sums_.get()});
  ++batches_;
}

const EliminatedSums& PoseElimination::finish() {
  const auto sum = [&](int index) {
    return Eigen::Map<const Eigen::Matrix<double, kLanes, 1>, Eigen::Aligned64>(sums_.get() +
                                                                                index * kLanes)
        .sum();
  };
  const int per_unknown = packed(unknowns_, 0);
  for (int k = 0; k < unknowns_; ++k) {
    for (int l = 0; l <= k; ++l) {
      out_.information(k, l) = out_.information(l, k) = sum(packed(k, l));
    }
    out_.gradient[k] = sum(per_unknown + k);
    out_.raw_gradient[k] = sum(per_unknown + unknowns_ + k);
    out_.raw_diagonal[k] = sum(per_unknown + 2 * unknowns_ + k);
  }
  const int last = per_unknown + 3 * unknowns_;
  out_.cost = 0.5 * sum(last);
  out_.decrease = 0.5 * sum(last + 1);
  const double* const steepest = sums_.get() + (last + 2) * kLanes;
  out_.largest_gradient = *std::max_element(steepest, steepest + kLanes);
  return out_;
}

PoseSteps PoseElimination::back_substitute(const Eigen::VectorXd& common_step) {
  PoseSteps out;
  for (std::size_t b = 0; b < batches_; ++b) {
    substitute_lanes({factors_ + b * factor_size_ * kLanes, offsets_, columns_, slots_->data(),
                      present_offsets_, common_step.data(), out.squared_norm, out.damping});
    if (stiffness_.empty()) continue;
    Eigen::Map<Eigen::Matrix<double, 6, kLanes, Eigen::RowMajor>> twists(
        factors_ + (b * factor_size_ + kFactorY) * kLanes);
    twists -= across_ * twists.eval();
  }
  return out;
}

const double* PoseElimination::steps(std::size_t batch) const {
  return factors_ + (batch * factor_size_ + kFactorY) * kLanes;
}

double PoseElimination::half_log_determinant(std::size_t poses) const {
  constexpr double kUnmeasured = 1e-10;  // of D: what damping alone leaves there is far less
  double sum = 0.0;
  for (std::size_t i = 0; i < poses; ++i) {
    const double* const factor = factors_ + i / kLanes * factor_size_ * kLanes + i % kLanes;
    for (int a = 0; a < 6; ++a) {
      const double inverse = factor[packed(a, a) * kLanes];
      const double pivot = 1.0 / (inverse * inverse);
      if (pivot > kUnmeasured * factor[(kFactorD + a) * kLanes]) sum += 0.5 * std::log(pivot);
    }
  }
  return sum;
}

void PoseElimination::left_over(const double* rows, const double* by_offset,
                                const double* by_effect, const Eigen::MatrixXd& covariance,
                                double* out) const {
  const Buffer scratch = buffer(static_cast<std::size_t>(unknowns_));
  const std::size_t last = steps_wanted_ && batches_ > 0 ? batches_ - 1 : 0;
  const PoseBatch batch{rows,
                        by_offset,
                        by_effect,
                        offsets_,
                        columns_,
                        slots_->data(),
                        present_offsets_,
                        static_cast<int>(slots_->size()),
                        damping_,
                        nullptr,
                        factors_ + last * factor_size_ * kLanes,
                        sums_.get()};
  left_over_lanes({batch, covariance.data(), covariance.outerStride(), scratch.get(), out});
}

}  // namespace cdprcal
