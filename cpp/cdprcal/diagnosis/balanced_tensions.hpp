// Private to diagnosis/: what load cells would read without their noise, for laws of the tension.
#pragma once

#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

/// A fitted model with Measurement::balanced_tension_N at its rests, fitted again: the readings
/// less the smallest change that would balance the platform. What is left of the noise is what the
/// balance does not see, so that a law of these tensions is not drawn to the noise of the readings,
/// as a law of the readings is (errors in variables).
DiagnosisModel with_balanced_tensions(DiagnosisModel model);

}  // namespace cdprcal
