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
  Matrix6 information = Matrix6::Zero();    ///< of ζ0 alone
  std::optional<Matrix6> covariance;        ///< its inverse, when that exists
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

  /// Rows that carry a reading, and unknowns that are free.
  [[nodiscard]] int residual_count() const { return residual_count_; }
  [[nodiscard]] int parameter_count() const { return parameter_count_; }

  /// ½ Σ (F/σ)² at the present state; NaN when a pose is invalid.
  double cost();
  ReferenceInformation reference_information();
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
