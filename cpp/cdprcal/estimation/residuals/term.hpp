// What the equations of eq. 13 share: where their rows go, and what they are made from.
#pragma once

#include <algorithm>
#include <array>

#include "cdprcal/estimation/pose_cache.hpp"
#include "cdprcal/estimation/reference_readings.hpp"

namespace cdprcal {

/// Most rows one pose can have: lengths, swivels, attitude, statics or reference errors, and what
/// absolute sensors read.
inline constexpr int kMostRows = 5 * kMaxCables + 4 + 6 + 4;

/// What a term looks at: the model and the readings at ζi and at ζ0.
struct TermInput {
  const CalibrationProblem& problem;
  const PoseCache& cache;  ///< weights and the whitening of the balance
  const ReferenceReadings& reference;
  std::size_t index;              ///< i of ζi
  const PoseEvaluation& at_pose;  ///< the model at ζi
  const PoseEvaluation& at_initial;
  const Vector3& position_m;  ///< of ζi

  [[nodiscard]] const Measurement& measured() const { return problem.measurements[index]; }
  [[nodiscard]] const PoseEvaluation& pose() const { return at_pose; }
  [[nodiscard]] const PoseEvaluation& initial() const { return at_initial; }
  [[nodiscard]] double weight(Channel channel) const { return cache.weight(index, channel); }
};

/// The whitened rows of one pose. Readings that count from the reference see ζ0 and the reference
/// errors only through their offset o = m(ζ0) + e: its index k and one number hold both
/// derivatives, ∂F/∂e_k = by_offset and ∂F/∂ζ0 = by_offset · ∂o_k/∂ζ0 (offset_jacobian).
struct PoseRows {
  int count = 0;
  std::array<double, kMostRows> residual;
  std::array<std::array<double, 6>, kMostRows> own;  ///< along a world-frame twist of ζi
  std::array<int, kMostRows> offset;                 ///< −1: none
  std::array<double, kMostRows> by_offset;
  std::array<RowLabel, kMostRows> label;
};

/// ∂o/∂ζ0 (2n+1 × 6): lengths, swivels, yaw.
using OffsetJacobian = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor, kMostOffsets, 6>;
inline OffsetJacobian offset_jacobian(const PoseEvaluation& initial) {
  const Eigen::Index n = initial.length_by_twist.rows();
  OffsetJacobian out(2 * n + 1, 6);
  out.topRows(n) = initial.length_by_twist;
  out.middleRows(n, n) = initial.swivel_by_twist;
  out.row(2 * n) = initial.attitude_by_twist.row(2);
  return out;
}

/// Appends whitened residuals and their derivatives, row by row.
class RowWriter {
 public:
  explicit RowWriter(PoseRows& rows) : rows_(rows) { rows_.count = 0; }

  /// weight · value, where value depends on ζi alone.
  template <typename Row>
  void absolute(RowLabel label, double value, double weight, const Row& by_twist) {
    Eigen::Map<Eigen::Matrix<double, 1, 6>>(start(label, weight * value, -1, 0.0)) =
        weight * by_twist;
  }
  /// weight · (m(ζi) − m(ζ0) − change − e): derivative of m at ζi, and which e it is.
  template <typename Row>
  void relative(RowLabel label, double value, double weight, const Row& by_twist, int error_index) {
    Eigen::Map<Eigen::Matrix<double, 1, 6>>(start(label, weight * value, error_index, -weight)) =
        weight * by_twist;
  }
  /// weight · e: depends on a reference error alone, and stands at the reference, whose rows have
  /// no other offsets.
  void error(RowLabel label, double value, double weight, int error_index) {
    std::fill_n(start(label, weight * value, error_index, weight), 6, 0.0);
  }

 private:
  /// Begins a row; returns where its derivatives by ζi go.
  double* start(const RowLabel& label, double residual, int offset, double by_offset) {
    const auto row = static_cast<std::size_t>(rows_.count++);
    rows_.residual[row] = residual;
    rows_.offset[row] = offset;
    rows_.by_offset[row] = by_offset;
    rows_.label[row] = label;
    return rows_.own[row].data();
  }

  PoseRows& rows_;
};

/// Readings of all cables relative to the reference:  F = (m(ζi) − m(ζ0) − Δ* − e) / σ, where e is
/// the error of the reference reading (held at 0 in the paper's formulation).
struct CableChanges {
  const CableVector& measured;        ///< at ζi; NaN: no row
  const CableVector& measured_first;  ///< at ζ0
  const CableVector& modelled;
  const CableVector& modelled_first;
  const CableJacobian& by_twist;
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
                  in.first_error + cable);
  }
}

}  // namespace cdprcal
