// How far the initial pose may be off because of what the log cannot rule out.
#pragma once

#include "cdprcal/evidence/scan.hpp"

namespace cdprcal {

/// What effects that were not accepted add to the covariance of the initial pose of run 0 (position
/// m, then world-frame rotation vector rad).
struct Unseen {
  /// Each weighed by the probability that it is there.
  Matrix6 probable = Matrix6::Zero();
  /// All of them there, at their typical sizes.
  Matrix6 possible = Matrix6::Zero();
};
/// Bayesian model averaging (Hoeting, Madigan, Raftery and Volinsky, Statistical Science 14, 1999)
/// over one more effect each. An effect that the readings speak against adds nothing; one that
/// these poses cannot show adds what it would do at its typical size, times the probability that it
/// is there. That is learnt from the robot itself: of the catalogue's effects, the share that was
/// found (Laplace's rule of succession). `scores`: a scan of this model, which must be fitted. NaN
/// where the model cannot be evaluated.
Unseen covariance_of_unseen(const DiagnosisModel& model, const std::vector<CandidateScore>& scores);

/// What models in the place of the present one add: their poses' distance, weighed by how probable
/// each is beside the present one. `log_evidence`: theirs minus its own.
struct Alternative {
  Pose pose;
  double log_evidence = 0.0;
};
Matrix6 covariance_of_alternatives(const Pose& present, const std::vector<Alternative>& others);

}  // namespace cdprcal
