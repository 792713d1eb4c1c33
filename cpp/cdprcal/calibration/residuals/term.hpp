// What the equations of eq. 13 share: where their rows go, and what they are made from.
#pragma once

#include "cdprcal/calibration/pose_cache.hpp"
#include "cdprcal/calibration/reference_readings.hpp"

namespace cdprcal {

/// What a term looks at: the model and the readings at ζi and at ζ0.
struct TermInput {
  const CalibrationProblem& problem;
  const PoseCache& cache;
  const ReferenceReadings& reference;
  std::size_t index;  ///< i of ζi

  [[nodiscard]] const Measurement& measured() const { return problem.measurements[index]; }
  [[nodiscard]] const PoseEvaluation& pose() const { return cache[index]; }
  [[nodiscard]] const PoseEvaluation& initial() const { return cache[0]; }
  [[nodiscard]] double weight(Channel channel) const { return cache.weight(index, channel); }
};

/// Writes whitened residuals and their derivatives, row by row, where Ceres wants them. A Jacobian
/// block with respect to a pose has one column more than the tangent: PoseManifold
/// (pose_manifold.hpp) has ∂plus/∂δ = [I₆; 0], so the first six columns are the derivative along a
/// world-frame twist and the last is never used. Pointers may be null: not wanted.
class RowWriter {
 public:
  /// `own`: by ζi; `initial`: by ζ0 (null at the reference itself, whose own block is ζ0);
  /// `error`: by the reference errors, `errors` columns.
  RowWriter(double* residuals, double* own, double* initial, double* error, int rows, int errors)
      : residuals_(residuals), own_(own), initial_(initial), error_(error), errors_(errors) {
    if (error_ != nullptr) std::fill_n(error_, rows * errors, 0.0);
  }

  /// Wanted: which reading each row is. One entry a row; null: not wanted.
  void label_rows(RowLabel* labels) { labels_ = labels; }

  /// weight · value, where value depends on ζi alone.
  template <typename Row>
  void absolute(RowLabel label, double value, double weight, const Row& by_twist) {
    start(label, weight * value);
    write(own_, weight, by_twist);
    if (initial_ != nullptr) std::fill_n(initial_ + kPoseBlockSize * row_, kPoseBlockSize, 0.0);
    ++row_;
  }
  /// weight · (m(ζi) − m(ζ0) − change − e): derivatives of m at both, and which e it is.
  template <typename Row, typename InitialRow>
  void relative(RowLabel label, double value, double weight, const Row& by_twist,
                const InitialRow& initial_by_twist, int error_index) {
    start(label, weight * value);
    write(own_, weight, by_twist);
    write(initial_, -weight, initial_by_twist);
    if (error_ != nullptr) error_[row_ * errors_ + error_index] = -weight;
    ++row_;
  }
  /// weight · e: depends on a reference error alone.
  void error(RowLabel label, double value, double weight, int error_index) {
    start(label, weight * value);
    if (own_ != nullptr) std::fill_n(own_ + kPoseBlockSize * row_, kPoseBlockSize, 0.0);
    if (error_ != nullptr) error_[row_ * errors_ + error_index] = weight;
    ++row_;
  }

 private:
  void start(const RowLabel& label, double residual) {
    residuals_[row_] = residual;
    if (labels_ != nullptr) labels_[row_] = label;
  }
  template <typename Row>
  void write(double* block, double weight, const Row& by_twist) {
    if (block == nullptr) return;
    Eigen::Map<Eigen::Matrix<double, 1, kPoseBlockSize>> out(block + kPoseBlockSize * row_);
    out.template head<6>() = weight * by_twist;
    out[6] = 0.0;
  }

  double* residuals_;
  double* own_;
  double* initial_;
  double* error_;
  RowLabel* labels_ = nullptr;
  Eigen::Index errors_;
  Eigen::Index row_ = 0;
};

/// Readings of all cables relative to the reference:  F = (m(ζi) − m(ζ0) − Δ* − e) / σ, where e is
/// the error of the reference reading (held at 0 in the paper's formulation).
struct CableChanges {
  const CableVector& measured;        ///< at ζi; NaN: no row
  const CableVector& measured_first;  ///< at ζ0
  const CableVector& modelled;
  const CableVector& modelled_first;
  const CableJacobian& by_twist;
  const CableJacobian& by_twist_first;
  Channel channel;
  double weight;
  int first_error;  ///< index of the first cable's e
  bool wrap;        ///< angles
};

inline int count_changes(const CableVector& measured, const CableVector& measured_first) {
  return static_cast<int>((measured - measured_first).array().isFinite().count());
}

inline void write_changes(const CableChanges& in, const double* errors, RowWriter& rows) {
  for (Eigen::Index c = 0; c < in.measured.size(); ++c) {
    const double change = in.measured[c] - in.measured_first[c];
    if (!std::isfinite(change)) continue;
    double value = in.modelled[c] - in.modelled_first[c] - change - errors[c];
    if (in.wrap) value = wrap_angle(value);
    const int cable = static_cast<int>(c);
    rows.relative({in.channel, cable}, value, in.weight, in.by_twist.row(c),
                  in.by_twist_first.row(c), in.first_error + cable);
  }
}

}  // namespace cdprcal
