// Does an effect predict poses it was not fitted on?
#pragma once

#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

/// Sums over held-out poses, each with its own six unknowns and nothing else free.
struct HeldOut {
  double before = 0.0;      ///< ½ Σ (residual/σ)² a pose without the effect, mean over folds
  double after = 0.0;       ///< the same with it, in the same σ (those of the fit with the effect)
  double gain = 0.0;        ///< total before − after
  double gain_error = 0.0;  ///< its standard error, from pose to pose
  NoiseLevels train_rms{}, held_out_rms{};  ///< with the effect: m, rad, rad, rad, N
};

/// What is held out at a time.
enum class HeldOutPart {
  poses,  ///< a quarter of them: blocks of time, and regions of the workspace
  log     ///< a whole log, whose own offsets it tells itself
};

/// Cross-validation: offsets and effects come from the other poses. Both models must be fitted.
HeldOut held_out(const DiagnosisModel& before, const DiagnosisModel& after,
                 HeldOutPart part = HeldOutPart::poses);

}  // namespace cdprcal
