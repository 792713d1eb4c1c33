// Effects that only motion shows: single samples between the rests join the model.
#pragma once

#include "cdprcal/diagnosis/model.hpp"

namespace cdprcal {

/// Correlation of what the model leaves at one sample in motion with what it leaves at the next.
double motion_correlation(const DiagnosisModel& model);

struct MotionOptions {
  int most_samples = 240;         ///< a run
  double least_spacing_s = 0.09;  ///< between two samples of a run
};

/// The model with samples in which the platform moves, as kinematic poses in channels of their own.
/// `logs` as the model's runs. The fastest samples outside of its rests are taken, spread over the
/// run; the poses come from following the readings sample by sample. Runs without motion, or
/// without three samples a second, add nothing.
DiagnosisModel with_motion(const DiagnosisModel& model, const std::vector<Log>& logs,
                           const MotionOptions& options = {});

/// The swivels' state of play by where the model says that they pointed all along the run, instead
/// of by their own readings, which stand still while the play is crossed. Nothing to do without the
/// effect swivel_hysteresis, whose half-width it depends on: both are found in turn.
void refine_swivel_play(DiagnosisModel& model, const std::vector<Log>& logs);

}  // namespace cdprcal
