// A calibration problem as least squares: its unknowns, its rows, its normal equations.
#pragma once

#include <Eigen/Cholesky>
#include <optional>
#include <vector>

#include "cdprcal/estimation/residuals/term.hpp"
#include "cdprcal/estimation/row_lanes.hpp"

namespace cdprcal {

/// Information left on the common unknowns when all measurement poses are eliminated (Schur), and
/// from it the covariance of ζ0. Linear in the number of poses.
struct ReferenceInformation {
  Matrix6 information = Matrix6::Zero();  ///< of ζ0 alone
  std::optional<Matrix6> covariance;      ///< its inverse, when that exists
};

/// Whether a symmetric matrix is so far from singular that its Cholesky factor may be relied upon.
inline bool is_regular(const Eigen::LLT<Matrix6>& factor) {
  if (factor.info() != Eigen::Success) return false;
  const Vector6 pivots = factor.matrixLLT().diagonal();
  return pivots.minCoeff() > 1e-5 * pivots.maxCoeff();
}

/// One whitened residual at the present state, and how much of its degree of freedom the fit left:
/// 1 − leverage, so its expected square is that.
struct FittedRow {
  RowLabel label;
  std::size_t pose = 0;
  double residual = 0.0;      ///< F/σ
  double freedom = 0.0;       ///< in [0, 1]
  double tension_gain = 0.0;  ///< wrench rows: PoseCache::tension_gain
};

/// The unknowns are the poses ζ0 … ζk and the reference errors; the rows are those of
/// residuals/, pose by pose.
class Assembly {
 public:
  /// `guess`: one pose a measurement. The problem must outlive the assembly.
  Assembly(const CalibrationProblem& problem, const std::vector<Pose>& guess);
  Assembly(const Assembly&) = delete;
  Assembly& operator=(const Assembly&) = delete;

  [[nodiscard]] const CalibrationProblem& problem() const { return problem_; }
  PoseCache& cache() { return cache_; }
  [[nodiscard]] const ReferenceReadings& reference() const { return reference_; }

  /// 2n + 1 values; throws InputError for another number of them.
  void set_reference_errors(const Eigen::Ref<const Eigen::VectorXd>& errors);
  [[nodiscard]] const OffsetVector& reference_errors() const { return reference_.errors(); }

  /// Rows that carry a reading, and unknowns that are free.
  [[nodiscard]] int residual_count() const { return residual_count_; }
  [[nodiscard]] int parameter_count() const { return parameter_count_; }

  /// The rows of eight poses at once; nullptr for problems that they do not serve.
  RowLanes* row_lanes();

  /// ½ Σ (F/σ)² at the present state; NaN when a pose is invalid.
  double cost();
  /// Root mean square of the statics' rows at the present state and weights; 0 without statics.
  double statics_rms();
  ReferenceInformation reference_information();
  /// One for each entry: nothing, or the channel without which (as if it had not been read, its
  /// readings at the reference included). The first alone has its covariance.
  std::vector<ReferenceInformation> reference_informations(
      const std::vector<std::optional<Channel>>& without);
  /// The rows of measurement `index` at any pose, with ζ0 as `initial` says (of measurement 0: what
  /// this call evaluates). False, and no rows, when one of the two is not valid.
  bool evaluate_rows(std::size_t index, const Pose& at, const PoseEvaluation& initial,
                     PoseEvaluation& evaluation, PoseRows& rows) const;
  /// The rows of a pose of the cache, as of its last update; false where it or ζ0 is not valid.
  bool cached_rows(std::size_t index, PoseRows& rows) const;
  /// ∂o/∂ζ0 as of the cache's last update.
  [[nodiscard]] OffsetJacobian offsets_by_initial() const { return offset_jacobian(cache_[0]); }
  /// How many rows a measurement has, valid or not.
  [[nodiscard]] int rows_at(std::size_t index) const;
  /// Every residual with its freedom; empty when a pose is invalid. Linear in the number of poses.
  std::vector<FittedRow> fitted_rows();
  /// Whitened residuals and their dense Jacobian: six columns a pose, then the reference errors
  /// (zero where they are held).
  void linearise(Eigen::VectorXd& residuals, Eigen::MatrixXd& jacobian);
  /// The present state's residuals in their own units.
  [[nodiscard]] std::vector<PoseResidual> residuals();

 private:
  bool write(std::size_t index, const Pose& at, const PoseEvaluation& initial,
             const PoseEvaluation& evaluation, PoseRows& rows) const;
  /// Calls at(index, rows) with the rows of each pose after ζ0, or batch(index) when those of eight
  /// poses are in the row lanes, whichever this problem has. False when a pose is invalid.
  template <typename Single, typename Batch>
  bool visit(const Single& at, const Batch& batch);
  /// Information on ζ0 and the reference errors with all other poses eliminated, for each entry of
  /// `without`; NaN when a pose is invalid. Rows and columns of held errors are zero.
  std::vector<CommonMatrix> common_informations(const std::vector<std::optional<Channel>>& without);
  [[nodiscard]] PoseResidual residual(std::size_t index) const;
  [[nodiscard]] ReferenceInformation of_reference(const CommonMatrix& common,
                                                  bool with_covariance) const;

  const CalibrationProblem& problem_;
  PoseCache cache_;
  ReferenceReadings reference_;
  std::optional<RowLanes> row_lanes_;
  bool row_lanes_tried_ = false;
  int residual_count_ = 0;
  int parameter_count_ = 0;
};

}  // namespace cdprcal
