// What a log can say at all: how many readings are left to check a model by, and how well they tell
// the noise.
#pragma once

#include <algorithm>
#include <string>

#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

/// Correlation of what the model leaves at one sample in motion with what it leaves at the next.
double motion_correlation(const DiagnosisModel& model);
/// Of samples that count as witnesses of their own, at most.
inline constexpr double kMostShared = 0.2;

/// How many readings are left to check a model by once each pose is where its own readings want it,
/// and how many constants of the sensors (offsets) they have to tell as well.
struct Checks {
  double readings = 0.0;
  int constants = 0;
  /// Of the errors of a run's samples, where these count for want of rests: how much neighbours
  /// share.
  double shared = 0.0;
  /// A fit with fewer readings left than constants told is a fit to itself: nothing that the model
  /// lacks would show. Of samples that share errors nobody knows how many readings they are.
  [[nodiscard]] bool enough() const {
    return readings >= std::max(1, constants) && !(shared > kMostShared);
  }
};
Checks checks_of(const DiagnosisModel& model);
/// Why such a log is too little, for people.
std::string too_little(const Checks& checks);

/// The model with noise as large as it may well be: a level that was estimated from ν residuals is
/// uncertain itself, which makes of a normal error one of Student's t with the variance ν/(ν − 2).
DiagnosisModel with_uncertain_noise(DiagnosisModel model);

}  // namespace cdprcal
