// How far the initial pose may be off because of what the log cannot rule out.
#pragma once

#include "cdprcal/evidence/scan.hpp"

namespace cdprcal {

/// What another model says of the initial pose of run 0.
struct Possibility {
  double probability = 0.0;  ///< that it holds in the place of the present one
  /// Where it has the pose, from the present one's (position m, then world-frame rotation vector
  /// rad), and how much less it knows of it.
  Vector6 shift = Vector6::Zero();
  Matrix6 spread = Matrix6::Zero();
};

/// What effects that were not accepted may do to the initial pose.
struct Unseen {
  std::vector<Possibility> each;  ///< one more of them
  /// What all of them at their typical sizes add to the covariance. NaN where the model cannot be
  /// evaluated.
  Matrix6 possible = Matrix6::Zero();
  /// What one more of them adds to the variance of each value of the accepted effects, averaged
  /// over the models.
  Eigen::VectorXd of_values;
};
/// An effect that the readings speak against is improbable; one that these poses cannot show may do
/// what it does at its typical size, with the probability that it is there. That is learnt from the
/// robot itself: of the catalogue's effects, the share that was found (Laplace's rule of
/// succession). `scores`: a scan of this model, which must be fitted. Steps at the first move
/// count, too, by what the readings say of them. What the robot file says is there is.
Unseen unseen_effects(const DiagnosisModel& model, std::vector<CandidateScore> scores);

/// What a fitted model says of the initial pose of run 0.
struct InitialPose {
  Pose pose;
  Matrix6 covariance = Matrix6::Zero();
};
InitialPose initial_pose_of(const DiagnosisModel& model);

/// Another model, with this probability, in the place of the present one.
Possibility in_place_of(const InitialPose& present, const InitialPose& other, double probability);

/// A fitted model in the place of the present one. `log_evidence`: its own minus the present one's.
struct Alternative {
  InitialPose initial;
  double log_evidence = 0.0;
};
std::vector<Possibility> possibilities(const InitialPose& present,
                                       const std::vector<Alternative>& others);

/// Covariance of the initial pose where other models may hold (Bayesian model averaging: Hoeting,
/// Madigan, Raftery and Volinsky, Statistical Science 14, 1999). `own`: the present one's. A rare
/// effect that moves the pose far hardly shows in a variance, and is beyond many σ where it is
/// there: the σ of each coordinate is at least so large that no more than one pose in a thousand
/// is for such a reason beyond 4 σ.
Matrix6 averaged_covariance(const Matrix6& own, const std::vector<Possibility>& others);
/// The same with the effects that were not accepted: one more of them, or all of them where the
/// readings are not `enough` to check a model by.
Matrix6 averaged_covariance(const Matrix6& own, const Unseen& unseen, bool enough,
                            std::vector<Possibility> others = {});

}  // namespace cdprcal
