// Effects that only motion shows: single samples between the rests join the model.
#pragma once

#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

struct MotionOptions {
  int most_samples = 240;         ///< a run
  double least_spacing_s = 0.09;  ///< between two samples of a run
};

/// A sample of a run and where the platform was.
struct FollowedSample {
  Eigen::Index row = 0;
  double speed = 0.0;  ///< of the attitude [rad/s]
  Pose pose;
  Measurement measurement;
};

/// Every sample of a run with its pose, followed from the first one, whose pose is known: each by
/// least squares over its own readings, the run's offsets and effects as they are. Samples that too
/// few readings tell the pose of are left out.
std::vector<FollowedSample> followed(const DiagnosisModel& model, std::size_t run, const Log& log);
/// The lengths and swivels that the model has at them, with the log's times.
Log path_through(const DiagnosisModel& model, std::size_t run,
                 const std::vector<FollowedSample>& samples, const Log& log);
/// Which of them are of these rows of the log.
SampleRange samples_of(const std::vector<FollowedSample>& samples, const SampleRange& rows);

/// The samples of all runs that move; empty for runs with fewer than three samples a second.
using MovingSamples = std::vector<std::vector<FollowedSample>>;
MovingSamples moving_samples(const DiagnosisModel& model, const std::vector<Log>& logs);

/// The model with samples in which the platform moves, as kinematic poses in channels of their own.
/// The fastest of `samples`, one entry a run, are taken, spread over the run. `logs` as the model's
/// runs.
DiagnosisModel with_motion(const DiagnosisModel& model, MovingSamples samples,
                           const MotionOptions& options);
inline DiagnosisModel with_motion(const DiagnosisModel& model, const std::vector<Log>& logs,
                                  const MotionOptions& options = {}) {
  return with_motion(model, moving_samples(model, logs), options);
}

/// The swivels' state of play by where the model says that they pointed all along the run, instead
/// of by their own readings, which stand still while the play is crossed. Nothing to do without the
/// effect of the swivels' play, whose half-width it depends on: both are found in turn.
void refine_swivel_play(DiagnosisModel& model, const std::vector<Log>& logs);

}  // namespace cdprcal
