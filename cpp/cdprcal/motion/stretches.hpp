// What is read along stretches of a path, as readings of their middles.
#pragma once

#include <optional>

#include "cdprcal/effects/corrected_run.hpp"
#include "cdprcal/motion/known_offsets.hpp"
#include "cdprcal/motion/smoothed.hpp"

namespace cdprcal {

/// What a moment of motion says by itself drowns in how badly accelerations are known. Their errors
/// cancel over a while, though: with a weight w(t) that ends smoothly ∫ w ν̇ dt = ∫ ẅ x dt, which is
/// as well known as positions are (modulating functions: Shinbrot 1957; Preisig and Rippin 1993).
/// So the balance (Ξᵀτ − f) + M ν̇ + h(ν) is averaged along the path with w ∝ (1 − u²)³, and so is
/// what the readings are ahead of the path: an error of the path is then the same in both, and an
/// estimate of the middle takes it back. A path that is smoothed too much loses nothing: what the
/// geometry of each sample says beside it counts by ẅ.
class Stretches {
 public:
  /// `known`: where readings count from, and their noise; `tension_sigma_N`: of one tension, white.
  /// A stretch is as short as leaves no more doubt of the motion than half of the tensions', and
  /// within `least_half_s` and `most_half_s` to both sides. Robot, run and path must outlive it.
  Stretches(const Robot& robot, const CorrectedRun& run, const std::vector<SmoothedSample>& path,
            const KnownOffsets& known, double tension_sigma_N, double least_half_s,
            double most_half_s);

  [[nodiscard]] double half_s() const { return half_s_; }
  /// The stretch about a row as a measurement at the path's pose there: readings, twist, and as its
  /// acceleration what makes the balance at that pose the mean. Nothing where the run does not go
  /// that far to both sides, the path has gaps, a cable is slack for a while, or tensions are not
  /// read. `inertial_covariance`: of what its motion takes [N, Nm].
  [[nodiscard]] std::optional<Measurement> about(Eigen::Index row,
                                                 Matrix6& inertial_covariance) const;

 private:
  struct Row {
    Vector6 balance = Vector6::Constant(kNaN), rising = balance;  ///< and Ξᵀ dτ/dt
    bool slack = false;
    ReadingVector misfit;
    Vector6 beside = Vector6::Constant(kNaN);  ///< the pose by the sample's own geometry
  };
  void mark_slack(double around_s, double tension_sigma_N);

  const Robot& robot_;
  const CorrectedRun& run_;
  const std::vector<SmoothedSample>& path_;
  /// Of the pose, by the geometry of one sample about the middle of the run.
  Matrix6 sample_covariance_ = Matrix6::Constant(kNaN);
  double half_s_ = 0.0;
  std::vector<Row> along_;  ///< of each row of the path
};

}  // namespace cdprcal
