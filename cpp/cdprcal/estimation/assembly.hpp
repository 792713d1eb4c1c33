// A calibration problem as least squares: its unknowns, its rows, its normal equations.
#pragma once

#include <Eigen/Cholesky>
#include <memory>
#include <optional>
#include <vector>

#include "cdprcal/estimation/estimation.hpp"
#include "cdprcal/estimation/reference_readings.hpp"
#include "cdprcal/estimation/weighed_poses.hpp"

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
  double residual = 0.0;        ///< F/σ
  double freedom = 0.0;         ///< in [0, 1]
  double tension_gain = 0.0;    ///< wrench rows: WeighedPoses::tension_gain
  double inertial_share = 0.0;  ///< and WeighedPoses::inertial_share
};

/// The unknowns are the poses ζ0 … ζk and the reference errors e. Every row but those of absolute
/// readings sees ζ0 and e through the offset o = m(ζ0) + e alone, and the reference's own readings
/// are rows like any other: so the poses are all alike, ζ0 among them, and o is what they share.
/// The paper's formulation holds e at 0, so that o is m(ζ0).
class Assembly {
 public:
  /// `guess`: one pose a measurement. The problem must outlive the assembly.
  Assembly(const CalibrationProblem& problem, const std::vector<Pose>& guess);
  Assembly(const Assembly&) = delete;
  Assembly& operator=(const Assembly&) = delete;

  [[nodiscard]] const CalibrationProblem& problem() const { return problem_; }
  [[nodiscard]] const FreeMotion& free_motion() const { return rows_.free_motion(); }
  WeighedPoses& poses() { return poses_; }
  [[nodiscard]] const ReferenceReadings& reference() const { return reference_; }

  /// 2n + 1 values; throws InputError for another number of them.
  void set_reference_errors(const Eigen::Ref<const Eigen::VectorXd>& errors);
  [[nodiscard]] const OffsetVector& reference_errors() const { return reference_.errors(); }

  /// Rows that carry a reading, and unknowns that are free.
  [[nodiscard]] int residual_count() const { return rows_.row_count(); }
  [[nodiscard]] int parameter_count() const;
  /// Whether there are as many rows as unknowns, poses that add more unknowns than rows apart.
  [[nodiscard]] bool may_be_determined() const;

  /// Weights that stay as they are while a minimiser goes on: derivatives by moments in motion are
  /// then those of the tensions as read (RunRows::tension_noise).
  void hold_weights() { holds_weights_ = true; }
  /// Minimises ½ Σ (F/σ)² (eq. 14) over all poses and the free reference errors, and leaves the
  /// minimum here. ζ0 may be held where it is.
  MinimiserSummary minimise(const MinimiserOptions& options, bool hold_initial_pose = false);

  /// ½ Σ (F/σ)² at the present state; NaN when a pose is invalid.
  double cost();
  /// Root mean square of the statics' rows at the present state and weights; 0 without statics.
  double statics_rms();
  ReferenceInformation reference_information();
  /// One for each entry: nothing, or the channel without which (as if it had not been read, its
  /// readings at the reference included). The first alone has its covariance.
  std::vector<ReferenceInformation> reference_informations(
      const std::vector<std::optional<Channel>>& without);
  /// Of a rest whose balance has fewer than six equations, as last evaluated; none elsewhere.
  [[nodiscard]] const PartialBalance* partial_balance(std::size_t measurement) const;
  /// The cable without a load cell that would have to push hardest at a rest of the present state,
  /// by more than the balance may be wrong by.
  struct Push {
    std::size_t measurement = 0;
    int cable = 0;
    double force_N = 0.0;
  };
  std::optional<Push> hardest_push();
  /// The rows of every measurement; empty when a pose is invalid.
  std::vector<PoseRows> rows();
  /// How many rows a measurement has, valid or not.
  [[nodiscard]] int rows_at(std::size_t index) const { return rows_.row_count(lane_of(index)); }
  /// ∂o/∂ζ0 at the present state; NaN when ζ0 is invalid.
  [[nodiscard]] OffsetJacobian offsets_by_initial() const;
  /// Every residual with its freedom; empty when a pose is invalid. Linear in the number of poses.
  std::vector<FittedRow> fitted_rows();
  /// Whitened residuals and their dense Jacobian: six columns a pose, then the reference errors
  /// (zero where they are held).
  void linearise(Eigen::VectorXd& residuals, Eigen::MatrixXd& jacobian);
  /// The present state's residuals in their own units.
  std::vector<PoseResidual> residuals();

 private:
  /// The reference comes last, so that where it is no block it costs no batch.
  [[nodiscard]] std::size_t lane_of(std::size_t measurement) const {
    return (measurement == 0 ? poses_.size() : measurement) - 1;
  }
  [[nodiscard]] std::size_t measurement_of(std::size_t lane) const {
    return lane + 1 < poses_.size() ? lane + 1 : 0;
  }
  [[nodiscard]] bool is_tied() const { return !problem_.reference_noise; }
  [[nodiscard]] RunReadings run_readings() const;
  /// Hands weights and offsets over to the rows; returns the offsets, or nothing when ζ0 is
  /// invalid.
  std::optional<OffsetVector> hand_over(PoseLanes& poses);
  /// Calls visit(batch) with the rows of each batch. False when a pose is invalid.
  template <typename Visit>
  bool visit(const Visit& visit);
  Estimation& estimation(bool hold_initial_pose);
  class Weighed;
  /// Weighs the balance of moments in motion at these poses.
  void weigh_motion(const PoseLanes& poses);
  /// Information on ζ0 and the reference errors with all other poses eliminated, for each entry of
  /// `without`; NaN when a pose is invalid. Rows and columns of held errors are zero.
  std::vector<Eigen::MatrixXd> common_informations(
      const std::vector<std::optional<Channel>>& without);
  /// What the reference's own readings are off by, whether or not they have rows.
  void complete_reference(PoseResidual& residual) const;
  [[nodiscard]] ReferenceInformation of_reference(const Eigen::MatrixXd& common,
                                                  bool with_covariance) const;

  const CalibrationProblem& problem_;
  WeighedPoses poses_;
  ReferenceReadings reference_;
  RunRows rows_;
  std::unique_ptr<Estimation> estimation_;
  int weights_version_ = -1;
  bool holds_weights_ = false;
};

}  // namespace cdprcal
