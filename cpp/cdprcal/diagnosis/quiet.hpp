// Private to diagnosis/: what laws look at, without the noise of the readings that it is found from
// (errors in variables): a law of those is drawn to that noise, and there in every log.
#pragma once

#include <optional>
#include <vector>

#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

/// A fitted model with Measurement::balanced_tension_N at its rests: the readings less the smallest
/// change that would balance the platform. What is left of the noise is what the balance does not
/// see. And with directions of motion that are sure (with_sure_directions). Fitted again. `logs`:
/// one a run; none: the directions stay.
DiagnosisModel with_quiet_covariates(DiagnosisModel model, const std::vector<Log>& logs);

/// Directions of motion are read off the log, whose noise a smoothed reading has lost. An error
/// that stays over a rest and is another at the next it has not: it goes on changing when the
/// platform has all but arrived, and the direction found is its own. So what a fitted model leaves
/// of lengths and swivels beyond their ripple is a dead band of their motion, and of a cable or a
/// swivel that is no further from where it was at the rest before nobody knows: s is 0 there.
/// Fitted again; nothing where readings are so sure that this changes nothing.
std::optional<DiagnosisModel> with_sure_directions(const DiagnosisModel& model,
                                                   const std::vector<Log>& logs);

/// Whether what an effect does depends on directions of motion.
bool looks_at_directions(const Effect& effect, const DiagnosisModel& model);

}  // namespace cdprcal
