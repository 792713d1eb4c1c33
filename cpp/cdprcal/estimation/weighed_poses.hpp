// The poses of a calibration, and how its readings there are weighed.
#pragma once

#include <array>
#include <vector>

#include "cdprcal/estimation/balance_roots.hpp"
#include "cdprcal/estimation/problem.hpp"

namespace cdprcal {

/// Poses, and the weights of the readings there.
class WeighedPoses {
 public:
  WeighedPoses(const CalibrationProblem& problem, const std::vector<Pose>& poses);
  WeighedPoses(const WeighedPoses&) = delete;
  WeighedPoses& operator=(const WeighedPoses&) = delete;

  /// The problem's robot with the geometry of its effects.
  [[nodiscard]] const Robot& robot() const { return changed_ ? *changed_ : problem_.robot; }

  [[nodiscard]] const Pose& pose(std::size_t index) const { return poses_[index]; }
  void set_pose(std::size_t index, const Pose& pose) { poses_[index] = pose; }
  [[nodiscard]] std::size_t size() const { return poses_.size(); }

  /// 1/σ of a reading of a channel at a pose (the balance: of a tension, without graduation).
  [[nodiscard]] const std::array<double, kChannels>& weights(std::size_t pose) const {
    return weights_[pose];
  }
  [[nodiscard]] double weight(std::size_t pose, Channel channel) const {
    return weights_[pose][static_cast<std::size_t>(channel)];
  }
  [[nodiscard]] StaticsModel statics_of(std::size_t pose) const { return statics_[pose]; }

  /// Fixes the whitening of every wrench residual at the present poses: an inverse square root of
  /// graduation² · (σ_τ² ΞᵀΞ + diag(σ_w²)). Its rows are the principal axes of the tensions'
  /// part in units of the rest (wrench_sigma), so that each mixes the two in a known proportion.
  void update_wrench_whitening(double graduation);
  /// Any inverse square root of it, a third of the work: the cost is the same, tension_gain is not
  /// known then.
  void update_wrench_weights(double graduation);
  /// What the balance at a pose may be wrong by, at the present graduation.
  [[nodiscard]] BalanceSigma balance_sigma(std::size_t pose) const;
  /// Grows with each of these two.
  [[nodiscard]] int weights_version() const { return weights_version_; }
  [[nodiscard]] const Matrix6& wrench_whitening(std::size_t pose) const { return whitening_[pose]; }
  /// Variance of a wrench row, before whitening and in units of the rest, that one N² of
  /// tension variance makes: 0 for what no tension can balance.
  [[nodiscard]] double tension_gain(std::size_t pose, int row) const {
    return tension_gain_[pose][row];
  }
  /// 1/σ of tension residuals at the present graduation.
  [[nodiscard]] double tension_weight(std::size_t pose) const {
    return weight(pose, Channel::balance) / graduation_;
  }

  /// Of the variance of a row of the balance that no tension makes, the share that what is not
  /// known of its motion makes, and not the model's own error. `weights`: of the wrench in it.
  [[nodiscard]] double inertial_share(std::size_t pose, const Vector6& weights) const;

 private:
  /// The model's own error and what is not known of the motion [N, Nm].
  [[nodiscard]] Vector6 wrench_sigma(std::size_t pose) const;
  /// The poses with all six equations of the balance that have moved since `known_at`, which then
  /// says so.
  [[nodiscard]] std::vector<std::size_t> moved(std::vector<Pose>& known_at) const;

  const CalibrationProblem& problem_;
  std::optional<Robot> changed_;  ///< where there are effects
  std::vector<Pose> poses_;
  std::vector<StaticsModel> statics_;
  std::vector<Pose> whitened_at_;  ///< where axes_ belong; NaN: nowhere yet
  std::vector<Pose> rooted_at_;    ///< where roots_ belong; NaN: nowhere yet
  std::vector<Matrix6> whitening_;
  std::vector<Matrix6> axes_;   ///< of the tensions' part of the balance, in units of the model's
  std::vector<Matrix6> roots_;  ///< whitening without principal axes, at graduation 1
  std::vector<Vector6> tension_gain_;
  std::vector<std::array<double, kChannels>> weights_;
  double graduation_ = 1.0;
  int weights_version_ = 0;
  double wrench_force_N_ = 1.0, wrench_moment_Nm_ = 1.0;
};

}  // namespace cdprcal
