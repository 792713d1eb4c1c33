// Where something pushes a platform whose winches stand still: its swing gains energy.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "cdprcal/motion/smoothed.hpp"

namespace cdprcal {

struct Push {
  double begin_s = kNaN, end_s = kNaN;
  double before_J = 0.0, after_J = 0.0;  ///< of the swing
};

/// Cables of constant length do no work, and what holds a platform back takes energy away. Looked
/// at is twice the kinetic energy ½νᵀMν, averaged over periods of the slowest mode: the energy of a
/// swing, since half of it is kinetic on the average (virial theorem), whatever the modes are.
/// Heights, of which the path knows less than of speeds, take no part. A push is a time in which it
/// grows by more than a third, and by more than errors of the twists make of none. Looked at is
/// where no winch turns and nothing rests, for three such periods at least.
std::vector<Push> pushes(const Calibration& calibration, const CorrectedRun& run,
                         std::span<const SmoothedSample> path);

/// Adds pushes to those that are known; of those that touch one is made, the energies of the
/// larger.
void add(const std::vector<Push>& more, std::vector<Push>& pushes);

/// Whether a time is within a push, or so near to one.
bool is_pushed(const std::vector<Push>& pushes, double time_s, double around_s = 0.0);

/// "5.1 to 8.9 s and 11.9 to 16.6 s".
std::string in_words(const std::vector<Push>& pushes);

}  // namespace cdprcal
