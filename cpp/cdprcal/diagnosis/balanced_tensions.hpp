// Private to diagnosis/: what load cells would read without their noise, for laws of the tension.
#pragma once

#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

/// Fills in Measurement::balanced_tension_N at the rests of a fitted model: the readings less the
/// smallest change that would balance the platform. What is left of the noise is what the balance
/// does not see, so that a law of these tensions is not drawn to the noise of the readings, as it
/// would be (errors in variables). Where a law is real but not in the model yet, it counts as noise
/// here: call it again with the law in.
void balance_tensions(DiagnosisModel& model);

}  // namespace cdprcal
