// Which direction of the initial pose the readings know least, and which readings know it at all.
#pragma once

#include <string>

#include "cdprcal/estimation/assembly.hpp"

namespace cdprcal {

/// The direction of largest standard deviation of ζ0, rotations weighed by the platform's
/// characteristic length so that they compare with positions.
struct LeastObserved {
  Vector6 direction = Vector6::Zero();  ///< world-frame twist; its larger half has norm 1
  bool is_rotation = false;             ///< which half that is
  double sigma = kNaN;                  ///< along it [m or rad]; infinite: nothing determines it
  Channel seen_by = Channel::length;    ///< the channel without which sigma grows most
  double sigma_without = kNaN;          ///< then; infinite: only that channel sees it
  /// Ratio of the largest to the smallest standard deviation in those units: 1 is ideal.
  double condition = kNaN;
  std::string sentence;              ///< for people
  ReferenceInformation information;  ///< of all readings
};

/// At the assembly's present state, which should be a minimum.
LeastObserved least_observed(const CalibrationProblem& problem, Assembly& assembly);

}  // namespace cdprcal
