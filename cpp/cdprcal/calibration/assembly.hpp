// Puts a calibration problem together as a Ceres problem, and reads its normal equations back.
#pragma once

#include <ceres/ordered_groups.h>
#include <ceres/problem.h>

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "cdprcal/calibration/pose_cache.hpp"
#include "cdprcal/calibration/pose_manifold.hpp"

namespace cdprcal {

/// Information left on the common unknowns when all measurement poses are eliminated (Schur), and
/// from it the covariance of ζ0. Linear in the number of poses.
struct ReferenceInformation {
  Matrix6 information = Matrix6::Zero();    ///< of ζ0 alone
  std::optional<Matrix6> covariance;        ///< its inverse, when that exists
};

/// The Ceres problem: one block a pose (ζ0 … ζk) and one block of reference-reading errors a
/// channel group (lengths, swivels, yaw).
class Assembly {
 public:
  /// `guess`: one pose a measurement. The problem must outlive the assembly.
  Assembly(const CalibrationProblem& problem, const std::vector<Pose>& guess);

  PoseCache& cache() { return cache_; }
  ceres::Problem& ceres_problem() { return *ceres_problem_; }
  /// Poses first, ζ0 and the reference errors last.
  [[nodiscard]] std::shared_ptr<ceres::OrderedGroups<double*>> elimination_order();

  /// Rows that carry a reading, and unknowns that are free.
  [[nodiscard]] int residual_count() const { return residual_count_; }
  [[nodiscard]] int parameter_count() const { return parameter_count_; }

  /// ½ Σ (F/σ)² at the present state; NaN when a pose is invalid.
  double cost();
  ReferenceInformation reference_information();
  /// Whitened residuals and their dense Jacobian: six columns a pose, then the reference errors.
  void linearise(Eigen::VectorXd& residuals, Eigen::MatrixXd& jacobian);
  /// The present state's residuals in their own units.
  [[nodiscard]] std::vector<PoseResidual> residuals() const;

 private:
  enum Group { lengths = 0, swivels = 1, yaw = 2 };
  static constexpr int kNoGroup = -1;
  struct Entry {
    const ceres::CostFunction* cost;
    std::size_t pose;   ///< which ζi; 0 when only ζ0 or a reference error is involved
    int group;          ///< which reference-error block, or kNoGroup
    bool relative;      ///< blocks (ζ0, ζi, e); otherwise (ζi) or (e)
  };

  void add(std::unique_ptr<ceres::CostFunction> cost, std::size_t pose, int group, bool relative);
  [[nodiscard]] CableVector reading(std::size_t pose, int group) const;
  void prepare_reference();
  [[nodiscard]] int common_size() const;
  [[nodiscard]] int group_offset(int group) const;

  const CalibrationProblem& problem_;
  PoseCache cache_;
  PoseManifold manifold_;
  std::array<CableVector, 3> base_;             ///< what changes are measured from
  std::array<CableVector, 3> reference_error_;  ///< parameter blocks e
  std::array<CableVector, 3> error_is_free_;    ///< 1 where e is estimated
  std::vector<std::unique_ptr<ceres::Manifold>> subset_manifolds_;  ///< errors partly held
  std::unique_ptr<ceres::Problem> ceres_problem_;
  std::vector<Entry> entries_;
  int residual_count_ = 0;
  int parameter_count_ = 0;
};

}  // namespace cdprcal
