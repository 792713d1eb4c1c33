// Errors of the sensors that do not come anew at every rest: they wander with time.
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

/// Whether an effect is such noise.
bool is_smooth_errors(const Effect& effect);

/// Root mean squares over the rests of what such noise in a model adds to each channel: m, rad,
/// rad, rad, N (balance: to the load cells), NaN for channels that do not wander. Nothing in a
/// model without.
std::optional<std::array<double, kRestGroups>> smooth_rms(const DiagnosisModel& model);

}  // namespace cdprcal
