// Private to estimation/: a model of runs and effects as an estimation.
#pragma once

#include <memory>

#include "cdprcal/estimation/balance_roots.hpp"
#include "cdprcal/estimation/estimation.hpp"
#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

/// The rows of all runs of a model, with the columns of its effects and of candidates.
class ModelRows {
 public:
  explicit ModelRows(const DiagnosisModel& model, const Candidates& candidates = {});

  /// Weighs the readings anew, for noise that has changed.
  void weigh();
  /// The effects at these values (as in the layout's columns) in the rows of a run, and its balance
  /// weighed at these poses.
  void set_values(std::size_t run, const Eigen::VectorXd& values, const PoseLanes& poses);

  [[nodiscard]] const DiagnosisModel& model() const { return model_; }
  [[nodiscard]] const CommonLayout& layout() const { return layout_; }
  [[nodiscard]] RunRows& run(std::size_t index) { return *runs_[index]; }
  /// The poses of a run, side by side.
  [[nodiscard]] PoseLanes poses(std::size_t run) const;
  /// Offsets as rows have them: model − reading.
  [[nodiscard]] OffsetVector offsets(std::size_t run) const;
  /// By how much what is not known of its motion widens the balances of a run: the sum of the logs
  /// of the volumes' ratios. At the values and poses set last.
  [[nodiscard]] double motion_widening(std::size_t run) const { return motion_widening_[run]; }
  /// What a slot of a run is at a pose, and its σ.
  [[nodiscard]] SystemRow row(std::size_t run, std::size_t pose, const RowSlot& slot) const;

 private:
  const DiagnosisModel& model_;
  const Candidates candidates_;
  CommonLayout layout_;
  std::vector<std::unique_ptr<RunRows>> runs_;
  std::vector<double> motion_widening_;

  void weigh_motion(std::size_t run, const Robot& robot, const std::vector<Pose>& poses,
                    const std::vector<BalanceSigma>& uncertain,
                    const std::vector<std::size_t>& which, const std::vector<Matrix6>& roots);
};

/// A model as an estimation, at its own state.
class ModelEstimation : public Estimation {
 public:
  explicit ModelEstimation(const DiagnosisModel& model);
  /// `covariance`: of the common unknowns, as covariance() gives it.
  ChannelSums channel_sums(const Eigen::MatrixXd& covariance);
  double log_evidence();

 protected:
  ModelEstimation(const DiagnosisModel& model, std::unique_ptr<ModelRows> rows);
  bool prepare(std::size_t run, const PoseLanes& poses, const Eigen::VectorXd& values) override;
  ModelRows& rows() { return *rows_; }

 private:
  std::unique_ptr<ModelRows> rows_;
};

/// A model on its way to the maximum a posteriori. The model must outlive this.
class ModelFit : public ModelEstimation {
 public:
  explicit ModelFit(DiagnosisModel& model) : ModelEstimation(model), model_(model) {}
  /// Steps until settled; returns whether it did. The model has the outcome.
  bool fit(int max_steps);
  /// The model's noise has changed, or the widths of its priors.
  void weigh() {
    rows().weigh();
    set_precision(prior_precision(model_));
  }

 private:
  DiagnosisModel& model_;
};

}  // namespace cdprcal
