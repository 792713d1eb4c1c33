// What friction and hysteresis leave open: from which side cables and swivels came is not read.
#pragma once

#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

/// What a fitted model's estimates owe to directions of motion that may be others: by what their
/// own estimate may be off, by what motion too small for the encoders took from them during a
/// dwell, and by what came before power-on. Zero where no effect depends on them.
struct UncertainDirections {
  Matrix6 covariance = Matrix6::Zero();  ///< of the initial pose of run 0
  Eigen::VectorXd variance;              ///< of the effects' values
};
UncertainDirections uncertain_directions(const DiagnosisModel& model);

/// Whether what an effect does depends on directions of motion.
bool looks_at_directions(const Effect& effect, const DiagnosisModel& model);

}  // namespace cdprcal
