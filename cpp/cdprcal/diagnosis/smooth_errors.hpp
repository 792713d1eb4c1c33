// Errors that do not come anew at every rest: they wander with time, or change with the place.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "cdprcal/evidence/refit.hpp"

namespace cdprcal {

/// Errors that change smoothly with the platform's place, in each component of each channel
/// (Kennedy and O'Hagan, J. R. Stat. Soc. B 63, 2001: a Gaussian process, here the first terms of
/// its expansion over the poses of the runs), each channel's of a size of its own: candidates that
/// differ in how far apart two places are whose errors differ. They would swallow effects, and so
/// belong into a model only when the search for them is over. None where there are too few rests to
/// tell.
Candidates place_errors(const DiagnosisModel& model);

/// The likeliest of them, refitted, where it is likelier than none. `least_scanned`: evidence that
/// a scan must have for one to be refitted.
std::optional<Refit> likeliest_place_errors(const DiagnosisModel& model, double least_scanned);

/// Noise of all readings that wanders with time, as a candidate for a model: a random walk in each
/// component of each channel, with the first terms of its Karhunen-Loève expansion over the run as
/// values. It is no finding: with it in the model, an effect has to explain more than it does.
/// Nothing where there are too few rests to tell.
std::shared_ptr<const Effect> wandering_errors(const DiagnosisModel& model);

/// Whether an effect is of either kind.
bool is_smooth_errors(const Effect& effect);
/// How far apart two places are whose errors differ [m]; nothing for errors that wander with time
/// and for other effects.
std::optional<double> reach_of_errors_m(const Effect& effect);

/// Root mean squares over the rests of what one such effect of a model adds to each channel: m,
/// rad, rad, rad, N (balance: to the load cells), NaN for channels that it leaves alone.
std::array<double, kRestGroups> smooth_rms(const DiagnosisModel& model, const EffectTerm& term);

/// Whether such errors are none but those which the sensors are specified to have, in all channels.
bool within_specification(const DiagnosisModel& model, const EffectTerm& term);

}  // namespace cdprcal
