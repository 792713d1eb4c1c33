// Puts a calibration problem together as a Ceres problem, and reads its normal equations back.
#pragma once

#include <ceres/ordered_groups.h>
#include <ceres/problem.h>

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "cdprcal/calibration/pose_manifold.hpp"
#include "cdprcal/calibration/residuals/pose_cost.hpp"

namespace cdprcal {

/// Information left on the common unknowns when all measurement poses are eliminated (Schur), and
/// from it the covariance of ζ0. Linear in the number of poses.
struct ReferenceInformation {
  Matrix6 information = Matrix6::Zero();  ///< of ζ0 alone
  std::optional<Matrix6> covariance;      ///< its inverse, when that exists
};

/// One whitened residual at the present state, and how much of its degree of freedom the fit left:
/// 1 − leverage, so its expected square is that.
struct FittedRow {
  RowLabel label;
  std::size_t pose = 0;
  double residual = 0.0;      ///< F/σ
  double freedom = 0.0;       ///< in [0, 1]
  double tension_gain = 0.0;  ///< wrench rows: PoseCache::tension_gain
};

/// The Ceres problem: one parameter block a pose (ζ0 … ζk) and one of reference-reading errors;
/// one residual block a pose.
class Assembly {
 public:
  /// `guess`: one pose a measurement. The problem must outlive the assembly.
  Assembly(const CalibrationProblem& problem, const std::vector<Pose>& guess);

  PoseCache& cache() { return cache_; }
  ceres::Problem& ceres_problem() { return *ceres_problem_; }
  /// Poses first, ζ0 and the reference errors last.
  [[nodiscard]] std::shared_ptr<ceres::OrderedGroups<double*>> elimination_order();

  /// 2n + 1 values; throws InputError for another number of them.
  void set_reference_errors(const Eigen::VectorXd& errors);
  [[nodiscard]] const Eigen::VectorXd& reference_errors() const { return reference_.errors(); }

  /// Rows that carry a reading, and unknowns that are free.
  [[nodiscard]] int residual_count() const { return residual_count_; }
  [[nodiscard]] int parameter_count() const { return parameter_count_; }

  /// ½ Σ (F/σ)² at the present state; NaN when a pose is invalid.
  double cost();
  /// `without`: as if a channel had not been read (its readings at the reference included).
  ReferenceInformation reference_information(std::optional<Channel> without = {});
  /// Every residual with its freedom; empty when a pose is invalid. Linear in the number of poses.
  std::vector<FittedRow> fitted_rows();
  /// Whitened residuals and their dense Jacobian: six columns a pose, then the reference errors
  /// (zero where they are held).
  void linearise(Eigen::VectorXd& residuals, Eigen::MatrixXd& jacobian);
  /// The present state's residuals in their own units.
  [[nodiscard]] std::vector<PoseResidual> residuals() const;

 private:
  /// One residual block and its derivatives. Of fixed capacity: there may be 100,000 poses.
  struct EvaluatedBlock;
  [[nodiscard]] EvaluatedBlock evaluate(std::size_t pose) const;
  void hold_reference_errors();
  /// Information on ζ0 and the reference errors with all other poses eliminated; NaN when one is
  /// invalid. Rows and columns of held errors are zero.
  [[nodiscard]] Eigen::MatrixXd common_information(std::optional<Channel> without = {}) const;

  const CalibrationProblem& problem_;
  PoseCache cache_;
  PoseManifold manifold_;
  ReferenceReadings reference_;
  std::unique_ptr<ceres::Manifold> free_errors_;  ///< when some errors are held and some are not
  std::deque<PoseCost> costs_;  ///< never moved: ceres_problem_ keeps their addresses
  std::unique_ptr<ceres::Problem> ceres_problem_;
  int residual_count_ = 0;
  int parameter_count_ = 0;
};

}  // namespace cdprcal
