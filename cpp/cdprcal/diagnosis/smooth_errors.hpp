// Errors that do not come anew at every rest: they wander with time, or change with the place.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

/// Noise of all readings that wanders with time, as a candidate for a model: a random walk in each
/// component of each channel, with the first terms of its Karhunen-Loève expansion over the run as
/// values, each channel of a size of its own. It is no finding: with it in the model, an effect has
/// to explain more than it does. Nothing where there are too few rests to tell.
std::shared_ptr<const Effect> smooth_errors(const DiagnosisModel& model);

/// What a model may lack beside its effects: a smooth function of the platform's place in each
/// component of each channel (Kennedy and O'Hagan, J. R. Stat. Soc. B 63, 2001: a Gaussian process,
/// here the first terms of its expansion over the poses of the runs), each channel's of a size of
/// its own. `reach_m`: as far apart as two places are whose errors differ. It would swallow
/// effects, and so belongs into a model only when the search for them is over and something is
/// left. Nothing where there are too few rests to tell.
std::shared_ptr<const Effect> place_errors(const DiagnosisModel& model, double reach_m);

/// Root mean square over the rests of the distance of the platform from their middle [m].
double spread_of_rests_m(const DiagnosisModel& model);

/// Whether an effect is of either kind.
bool is_smooth_errors(const Effect& effect);

/// Root mean squares over the rests of what one such effect of a model adds to each channel: m,
/// rad, rad, rad, N (balance: to the load cells), NaN for channels that it leaves alone.
std::array<double, kRestGroups> smooth_rms(const DiagnosisModel& model, const EffectTerm& term);

}  // namespace cdprcal
