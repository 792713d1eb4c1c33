// The rows of a run's poses, eight at a time, in the form that the elimination takes them.
#pragma once

#include <optional>
#include <vector>

#include "cdprcal/effects/effect.hpp"
#include "cdprcal/estimation/pose_lanes.hpp"
#include "cdprcal/estimation/pose_residual.hpp"
#include "cdprcal/estimation/row_batch.hpp"
#include "cdprcal/estimation/unread_tensions.hpp"

namespace cdprcal {

/// An effect whose values have derivatives: where its columns begin, and what they are multiplied
/// by (empty: nothing).
struct EffectColumn {
  std::shared_ptr<const Effect> effect;
  EffectValues values;
  int begin = 0;
  EffectValues scale;
};

/// What a run's rows are made from.
struct RunReadings {
  std::vector<const Measurement*> measurements;
  std::vector<StaticsModel> statics;  ///< that each obeys
  OffsetVector base;                  ///< what lengths, swivels and yaw count from; NaN: not used
  /// Which of the measurements is the reference, and what counts there: of lengths, swivels and yaw
  /// those whose bit is set, roll and pitch.
  std::size_t reference = 0;
  std::uint32_t reference_offsets = ~0U;
  bool reference_roll_pitch = true;
};

/// What counts from an offset, at a pose: lengths, swivels, yaw (2n + 1).
OffsetVector offsets_of(const PoseEvaluation& at);

/// The rows of all poses of one run. Each row has a slot that is the same in all poses; where a
/// pose lacks the reading, its row is zero.
class RunRows {
 public:
  /// Gathers the readings. The measurements must outlive this.
  RunRows(const Robot& robot, RunReadings readings,
          const std::vector<WrenchRow>& left_inverse_rows);

  /// The robot with the geometry of its effects, those of them that act on readings or tensions,
  /// and the effects whose columns are wanted, `columns` in all.
  void set_effects(const Robot& robot, ActiveEffects effects,
                   std::vector<EffectColumn> derivatives = {}, int columns = 0);
  [[nodiscard]] const Robot& robot() const { return robot_; }
  [[nodiscard]] const FreeMotion& free_motion() const { return free_; }

  /// 1/σ of the readings of a pose, a channel; the balance's is that of a tension (left inverse).
  void set_weights(std::size_t pose, const std::array<double, kChannels>& weights);
  void set_tension_weight(std::size_t pose, double weight);
  /// What makes the rows of a balance independent and of unit variance.
  void set_whitening(std::size_t pose, const Matrix6& whitening);
  /// How many of the six equations of a balanced pose say nothing: unread tensions and guides have
  /// them. Where any does, the rows are whitened for this σ at every evaluation (partial_balance)
  /// instead.
  [[nodiscard]] int silent_rows(std::size_t pose) const { return silent_[pose]; }
  [[nodiscard]] bool any_silent() const { return any_silent_; }
  /// Also of a moment in motion with all six of them, so that its derivatives are those of tensions
  /// without their noise (tension_noise); they are those of the tensions as read where it is not
  /// given.
  void set_balance_sigma(std::size_t pose, const BalanceSigma& sigma) { sigma_[pose] = sigma; }
  [[nodiscard]] bool any_moves() const { return any_moves_; }
  /// Of such a pose as last evaluated.
  [[nodiscard]] const PartialBalance& partial_balance_of(std::size_t pose) const {
    return partial_[pose];
  }
  /// The offsets of what follows.
  void set_offsets(const double* offsets);

  /// Evaluates a batch of poses. False when a pose has no valid kinematics, or no tensions.
  bool evaluate(std::size_t batch, const PoseLanes& poses);
  /// What the model predicts at one of the poses, without statics. Good until the next call.
  [[nodiscard]] const PoseEvaluation& evaluate_alone(std::size_t pose, const Pose& at) const;
  /// By a twist of a pose, as far as the platform may make it: what counts from an offset.
  [[nodiscard]] OffsetJacobian offsets_by_twist(const PoseEvaluation& at) const;
  /// Of the last batch: rows [slot][6 derivatives, residual][lane], the offsets' slots first.
  [[nodiscard]] const double* rows() const { return rows_.get(); }
  /// Derivatives by the offsets, [offset][lane].
  [[nodiscard]] const double* by_offset() const { return by_offset_.get(); }
  /// Derivatives by values of effects, [slot][column][lane].
  [[nodiscard]] const double* by_effect() const { return columns_.get(); }
  /// Whether a pose has a row in a slot.
  [[nodiscard]] bool has_row(std::size_t pose, int slot) const;
  /// The rows of a pose of the last batch.
  void take(std::size_t pose, PoseRows& out) const;
  /// Makes the pose of a lane of the last batch say nothing: of its derivatives, or at all.
  void hold(std::size_t lane);
  void forget(std::size_t lane);

  /// Σ (F/σ)² of the last batch, of all rows or of a channel's.
  [[nodiscard]] double squared_residuals(std::optional<Channel> only = std::nullopt) const;
  /// Residuals of a pose of the last batch before whitening; NaN where there is none.
  void write_residual(std::size_t pose, PoseResidual& out) const;

  [[nodiscard]] std::size_t poses() const { return readings_.measurements.size(); }
  [[nodiscard]] std::size_t batches() const { return lanes::batches(poses()); }
  [[nodiscard]] const RowLayout& layout() const { return layout_; }
  [[nodiscard]] StaticsModel statics_of(std::size_t pose) const { return readings_.statics[pose]; }
  /// Rows that carry a reading: of a pose, and over all.
  [[nodiscard]] int row_count(std::size_t pose) const { return row_counts_[pose]; }
  [[nodiscard]] int row_count() const;
  /// The slots that any pose reads, without those of a channel.
  [[nodiscard]] std::vector<int> slots(std::optional<Channel> without = std::nullopt) const;

 private:
  void lay_out();
  void gather();
  /// Takes out of the last batch's derivatives the twists that guides prevent.
  void keep_to_motion();
  void complete_tensions(std::size_t pose, const PlatformState& state, const CableVector& tension_N,
                         const Vector6& load);
  void act_on_tensions(std::size_t batch, const PoseLanes& poses);
  /// What of the tensions of a pose is noise, as its balance tells: ε = σ_τ² Ξ WᵀW (Ξᵀτ − f), their
  /// most likely errors. Derivatives take Ξᵀ and effects of gain times a tension: with ε in it they
  /// go along with the residual, which pulls gains below 1 by (σ_τ/τ)² in every pose (errors in
  /// variables; Fuller, Measurement Error Models, 1987). Without it Jᵀ W F is the gradient of the
  /// cost whose weights follow poses and values. A rest is the mean of so many samples that nothing
  /// is to be seen of it; a moment is not. Empty where none is to be taken off.
  [[nodiscard]] CableVector tension_noise(std::size_t pose, const PlatformState& state) const;
  void change_readings(const EffectContext& context);
  [[nodiscard]] Vector6 load_on(const EffectContext& context);
  void act_on_readings(std::size_t batch, const PoseLanes& poses);
  void add_columns(const EffectContext& context, std::size_t lane, bool balanced);
  [[nodiscard]] double* number(std::size_t pose, int index) const {
    return numbers_.get() +
           ((pose / lanes::kLanes) * static_cast<std::size_t>(layout_.numbers) +
            static_cast<std::size_t>(index)) *
               lanes::kLanes +
           pose % lanes::kLanes;
  }
  [[nodiscard]] PlatformState state_of(std::size_t lane) const;

  Robot robot_;
  RunReadings readings_;
  std::vector<WrenchRow> left_inverse_rows_;
  ActiveEffects effects_;
  std::vector<EffectColumn> derivatives_;
  RowLayout layout_;
  std::vector<int> row_counts_;
  std::vector<int> weight_of_;  ///< a channel: where its weight is; −1: nowhere
  FreeMotion free_;
  TwistBasis guided_;        ///< what the platform may not do
  std::vector<int> silent_;  ///< of each pose
  bool any_silent_ = false, any_moves_ = false;
  std::vector<BalanceSigma> sigma_;      ///< where any is, or moves
  std::vector<PartialBalance> partial_;  ///< where any is silent
  lanes::Buffer numbers_, whitening_, tension_;
  OffsetVector offsets_;
  lanes::Buffer rows_, by_offset_, values_, state_, columns_;
  /// What was evaluated alone last.
  struct Alone {
    std::size_t pose = 0;
    Pose at{Vector3::Constant(kNaN), Eigen::Quaterniond::Identity()};
    PoseEvaluation evaluation;
  };
  mutable Alone alone_;
  PoseEvaluation change_;
  Eigen::MatrixXd by_value_;
};

}  // namespace cdprcal
