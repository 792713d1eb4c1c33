// Private to diagnosis/: what laws look at, without the noise of the readings that it is found from
// (errors in variables): a law of those is drawn to that noise, and there in every log.
#pragma once

#include <optional>
#include <vector>

#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

/// A fitted model with Measurement::balanced_tension_N at its rests: the readings less the smallest
/// change that would balance the platform. What is left of the noise is what the balance does not
/// see. And with the directions of the platform's motion (with_followed_directions). Fitted again.
/// `logs`: one a run; none: the directions stay.
DiagnosisModel with_quiet_covariates(DiagnosisModel model, const std::vector<Log>& logs);

/// Directions of motion are read off the log, whose noise a smoothed reading has lost. An error
/// that stays over a rest and is another at the next it has not: it may go on changing when the
/// platform has all but arrived, and the direction found is its own, as is the residual. Here they
/// are those in which lengths and swivels change at the poses that all readings of a sample
/// together tell: what these take of an error is not what they leave of it. Fitted again; nothing
/// where no samples tell a pose.
std::optional<DiagnosisModel> with_followed_directions(const DiagnosisModel& model,
                                                       const std::vector<Log>& logs);

/// A model whose first rests are read in their later half only, fitted again: what begins with the
/// log (a filter that runs in, a platform that still swings) has faded there. Nothing where no log
/// begins with a rest of several samples, or where the fit does not settle.
std::optional<DiagnosisModel> with_late_first_rests(const DiagnosisModel& model,
                                                    const std::vector<Log>& logs);

}  // namespace cdprcal
