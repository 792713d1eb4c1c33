// One or several runs as least squares: poses that are eliminated, offsets of each run, and values
// of effects that all share.
#pragma once

#include <functional>
#include <vector>

#include "cdprcal/estimation/arrowhead.hpp"
#include "cdprcal/estimation/elimination.hpp"

namespace cdprcal {

/// A Gaussian prior of the values of effects: precision 1/σ² of each about zero.
using ValuePrecision = Eigen::VectorXd;

/// A run in an estimation.
struct EstimatedRun {
  EstimatedRun(RunRows& rows_of, int columns)
      : rows(&rows_of),
        poses(rows_of.poses()),
        trial(rows_of.poses()),
        offsets(OffsetVector::Zero(rows_of.layout().offsets())),
        trial_offsets(offsets),
        slots(rows_of.slots()),
        elimination(rows_of.poses(), rows_of.layout().offsets(), columns, true,
                    rows_of.free_motion().across()) {}

  RunRows* rows;
  PoseLanes poses, trial;
  OffsetVector offsets, trial_offsets;
  std::vector<int> free_offsets;  ///< estimated; the others stay as they are
  std::size_t reference = 0;      ///< which pose is ζ0
  bool hold_reference = false;    ///< it stays where it is
  /// The paper's formulation: the offsets are m(ζ0) plus `errors`, of which only `free_offsets` are
  /// estimated, and ζ0 is a common unknown.
  bool tied = false;
  /// Then ζ0 is no block, and where it says nothing by itself it need not be evaluated.
  [[nodiscard]] bool is_reference_silent() const { return tied && rows->row_count(reference) == 0; }
  OffsetVector errors, trial_errors;
  OffsetJacobian by_reference;  ///< ∂m/∂ζ0 as of the last evaluation
  std::vector<int> slots;
  PoseElimination elimination;
};

/// Where minimise() steps. A pose meets the others only through its run's offsets and the values of
/// effects, so a step costs one evaluation of each pose, its 6 × 6 Cholesky factor, and one system
/// of what is common.
class Estimation : public ArrowheadProblem {
 public:
  /// `values`: of effects, none or as many as the runs' rows have columns.
  Estimation(std::vector<EstimatedRun> runs, Eigen::VectorXd values, ValuePrecision precision);

  bool linearise(bool on_trial, double damping, CommonSystem& out) override;
  TrialStep try_step(const Eigen::VectorXd& common_step) override;
  void accept() override;

  /// Covariance of the common unknowns at the state, all poses free; not finite where the state
  /// cannot be evaluated. What nothing measures has none.
  Eigen::MatrixXd covariance();
  /// The same from a system that was linearised at the state.
  static Eigen::MatrixXd covariance(const CommonSystem& system);
  /// Calls visit(run, batch, left) for every batch of the state: left [slot][2][lane] as of
  /// PoseElimination::left_over, and the run's rows those of the batch. False where the state
  /// cannot be evaluated.
  using VisitLeftOver = std::function<void(std::size_t run, std::size_t batch, const double* left)>;
  bool left_over(const Eigen::MatrixXd& covariance, const VisitLeftOver& visit);

  std::vector<EstimatedRun>& runs() { return runs_; }
  [[nodiscard]] const std::vector<EstimatedRun>& runs() const { return runs_; }
  [[nodiscard]] const Eigen::VectorXd& values() const { return values_; }
  [[nodiscard]] const ValuePrecision& precision() const { return precision_; }
  /// Of the tied run evaluated last: what its reference says by itself.
  [[nodiscard]] const PoseRows& reference_rows() const { return reference_rows_; }
  /// Common unknowns: of each run ζ0 (tied and not held) and the free offsets, then the values.
  [[nodiscard]] Eigen::Index common_size() const;

 protected:
  /// Called before a run's rows are evaluated at these poses and values: where weights or the
  /// robot follow them. False: they cannot.
  virtual bool prepare(std::size_t run, const PoseLanes& poses, const Eigen::VectorXd& values);
  void set_precision(ValuePrecision precision) { precision_ = std::move(precision); }

 private:
  /// Evaluates a run and adds its batches to the elimination; visit(batch) after each.
  template <typename Visit>
  bool sweep(std::size_t run, bool on_trial, double damping, const Visit& visit);
  bool add_run(std::size_t run, bool on_trial, double damping, Eigen::Index begin,
               CommonSystem& out);
  /// Batches of the run that are evaluated.
  [[nodiscard]] static std::size_t batches_of(const EstimatedRun& run);
  [[nodiscard]] Eigen::Index size_of(const EstimatedRun& run) const;
  /// ∂(offsets)/∂(the run's common unknowns).
  using OffsetsByUnknowns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor,
                                          kMostOffsets, 6 + kMostOffsets>;
  [[nodiscard]] OffsetsByUnknowns by_unknowns(const EstimatedRun& run) const;

  std::vector<EstimatedRun> runs_;
  Eigen::VectorXd values_, trial_values_;
  ValuePrecision precision_;
  Eigen::VectorXd run_step_;
  PoseRows reference_rows_;
};

}  // namespace cdprcal
