// Errors of sensors that are not anew at every rest and alike in all of a kind: they wander with
// time, change with the place, or are one sensor's own.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "cdprcal/evidence/refit.hpp"

namespace cdprcal {

/// How large errors may be.
enum class ErrorSize {
  any,
  specified,  ///< no larger than the robot file's σ: as the sensors may have them
};

/// Errors that change smoothly with the platform's place, or with time, in each component of each
/// channel (Kennedy and O'Hagan, J. R. Stat. Soc. B 63, 2001: a Gaussian process, here the first
/// terms of its expansion over the rests of the runs), each channel's of a size of its own:
/// candidates that differ in how far apart two places or moments are whose errors differ. They
/// would swallow effects, and so belong into a model only when the search for them is over. None
/// where there are too few rests to tell.
Candidates smooth_errors(const DiagnosisModel& model, ErrorSize size);

/// The likeliest of them, refitted, where it is likelier than none.
std::optional<Refit> likeliest_smooth_errors(const DiagnosisModel& model, ErrorSize size);

/// Noise of all readings that wanders with time, as a candidate for a model: a random walk in each
/// component of each channel, with the first terms of its Karhunen-Loève expansion over the run as
/// values. It is no finding: with it in the model, an effect has to explain more than it does.
/// Nothing where there are too few rests to tell.
std::shared_ptr<const Effect> wandering_errors(const DiagnosisModel& model, ErrorSize size);

/// Errors of one sensor, anew at every rest: a channel has one size of noise, and one load cell or
/// encoder may have more than its like. A walk is no finding, nor are these. Of each sensor whose
/// residuals are as much larger, as mean squares, than those of its like. None where there are too
/// few rests to tell.
Candidates own_errors(const DiagnosisModel& model, double larger = 1.5);
/// How many sensors have others like them.
int sensors_with_like(const DiagnosisModel& model);

/// Of which sensor.
struct OneSensor {
  Channel channel;
  int component;  ///< cable, or roll and pitch
};
/// Nothing for errors of all sensors, and for other effects.
std::optional<OneSensor> sensor_of_errors(const Effect& effect);
/// Whether an effect is errors that wander with time.
bool is_wandering_errors(const Effect& effect);
/// How far apart two places are whose errors differ [m]; nothing for other errors and effects.
std::optional<double> reach_of_errors_m(const Effect& effect);
/// What smooth errors are called, for people.
std::string words_of_smooth(const Effect& errors);

/// Root mean squares over the rests of what such errors of a model add to each channel: m,
/// rad, rad, rad, N (balance: to the load cells), NaN for channels that it leaves alone.
std::array<double, kRestGroups> rms_of_errors(const DiagnosisModel& model, const EffectTerm& term);

/// Errors of one sensor in one run that are those of one rest: its time in the run. At all others
/// they are no larger than errors of `like` [the channel's unit] may be by chance. Nothing where
/// several are.
std::optional<double> only_rest_s(const DiagnosisModel& model, const EffectTerm& term, double like);

}  // namespace cdprcal
