// What happens between two rests and stays: a step of the readings, or of the load.
#pragma once

#include <optional>

#include "cdprcal/evidence/scan.hpp"

namespace cdprcal {

struct Step {
  double time_s = 0.0;  ///< since the run's first sample: in the middle of the move
  std::optional<int> cable = std::nullopt;  ///< from 0; nothing: of all, or of the platform
  bool parts_a_rest = false;  ///< what it frees at one rest does all that another cause would there
};

/// One candidate for each step and pair of rests in a row:
/// - cable_slip: a cable slipped on its drum, unseen by the encoder; one for each cable
/// - load_shift: the platform's load moved, or became another
/// - load_cell_shift: the zero of a load cell jumped; one for each
/// - swivel_shift: a swivel encoder slipped on its axis; one for each, where these scatter
/// - ahrs_shift: the attitude sensor was knocked askew; where it scatters
/// and at a run's first move, where these part its first rest from all others:
/// - cable_slip: all cables together slipped, as where brakes let go
/// - contact: something bore the platform until then
/// - load_cell_shift: a load cell was off until then; one for each
Candidates step_candidates(const DiagnosisModel& model);
/// One of each kind, of the first cable where it is of one, for what there is to say of it.
Candidates kinds_of_steps(const Robot& robot);
/// Of those; nothing for another effect.
std::optional<Step> as_step(const Effect& effect);
/// The other steps at the time of this one.
Candidates steps_beside(const DiagnosisModel& model, const Effect& step);

/// Scores of those at the first move of run 0, as one of so many steps that there may be: what
/// happens there parts the initial pose from all that tells of it, and hardly shows.
std::vector<CandidateScore> first_step_scores(const DiagnosisModel& model);

}  // namespace cdprcal
