// Which direction of the initial pose the readings know least, and which readings know it at all.
#pragma once

#include <string>

#include "cdprcal/estimation/assembly.hpp"

namespace cdprcal {

/// The direction of largest standard deviation of ζ0, rotations weighed by the platform's
/// characteristic length so that they compare with positions; and the channel without which that
/// would grow most.
struct LeastObserved {
  std::string sentence;              ///< for people
  ReferenceInformation information;  ///< of all readings
};

/// At the assembly's present state, which should be a minimum. `shown`: the covariance that people
/// see, where it is another than the information's inverse; who sees the direction stays a question
/// of the information.
LeastObserved least_observed(const CalibrationProblem& problem, Assembly& assembly,
                             const Matrix6* shown = nullptr);

}  // namespace cdprcal
