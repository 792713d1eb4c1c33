// An attitude that is known to come late, read when it comes.
#pragma once

#include "cdprcal/calibration/calibrate.hpp"
#include "cdprcal/effects/corrected_run.hpp"

namespace cdprcal {

/// What effects make of the attitude that is read, by its rate [s]: −T·1 where it comes T late.
Matrix3 attitude_by_rate(const Robot& robot, const ActiveEffects& effects, const Measurement& at,
                         const Pose& pose);

/// A run whose attitudes are those read later, by as many whole samples as the effects of a
/// calibration make them late. An effect of the attitude's rate is the first term of a series, and
/// a swing has turned back in a delay that is no small part of its period; what is left of the
/// delay is at most half a sample. The attitude is NaN where nothing follows.
struct LateAttitudes {
  LateAttitudes(const Calibration& calibration, const CorrectedRun& run);
  LateAttitudes(const LateAttitudes&) = delete;
  LateAttitudes& operator=(const LateAttitudes&) = delete;

  const double ahead_s;  ///< how much later they are read
  const CorrectedRun run;
};

}  // namespace cdprcal
