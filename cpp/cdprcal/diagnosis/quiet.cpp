#include "cdprcal/diagnosis/quiet.hpp"

#include "cdprcal/diagnosis/model_residuals.hpp"
#include "cdprcal/diagnosis/motion.hpp"
#include "cdprcal/readings/path_state.hpp"

namespace cdprcal {
namespace {

/// Whether any samples tell.
bool follow_directions(DiagnosisModel& model, const std::vector<Log>& logs) {
  // A pose takes the same share of an error as at rest.
  DiagnosisModel as_at_rest = model;
  for (std::size_t c = 0; c < kRestGroups; ++c) as_at_rest.noise[c + kRestGroups] = model.noise[c];
  bool any = false;
  for (std::size_t r = 0; r < logs.size(); ++r) {
    DiagnosisRun& run = model.runs[r];
    const std::vector<FollowedSample> samples = followed(as_at_rest, r, logs[r]);
    if (samples.empty()) continue;
    const Log path = path_through(model, r, samples, logs[r]);
    const PathState state = path_state(model.robot, path);
    for (std::size_t i = 0; i < run.measurements.size(); ++i) {
      Measurement& m = run.measurements[i];
      const SampleRange range = samples_of(samples, run.rows[i]);
      if (is_moving(m) || range.size() < 1) continue;
      Measurement found = m;
      add_path(state, path, range, 0.0, found);
      m.length_direction = found.length_direction;
      m.swivel_direction = found.swivel_direction;
      any = true;
    }
  }
  return any;
}

}  // namespace

DiagnosisModel with_quiet_covariates(DiagnosisModel model, const std::vector<Log>& logs) {
  for (const ModelResidual& entry : model_residuals(model)) {
    Measurement& m = model.runs[entry.run].measurements[entry.pose];
    if (!m.in_balance() || m.moves() || entry.residual.tension_N.size() != m.tension_N.size()) {
      continue;
    }
    m.balanced_tension_N = m.tension_N - entry.residual.tension_N;
  }
  follow_directions(model, logs);
  fit_with_noise(model);
  return model;
}

std::optional<DiagnosisModel> with_followed_directions(const DiagnosisModel& model,
                                                       const std::vector<Log>& logs) {
  DiagnosisModel out = model;
  if (!follow_directions(out, logs) || !fit_with_noise(out)) return std::nullopt;
  return out;
}

std::optional<DiagnosisModel> with_late_first_rests(const DiagnosisModel& model,
                                                    const std::vector<Log>& logs) {
  constexpr Eigen::Index kFewest = 4;
  DiagnosisModel out = model;
  bool any = false;
  for (std::size_t r = 0; r < logs.size(); ++r) {
    DiagnosisRun& run = out.runs[r];
    const SampleRange& rest = run.rows.front();
    if (is_moving(run.measurements.front()) || rest.size() < kFewest) continue;
    const SampleRange late{rest.begin + rest.size() / 2, rest.end};
    std::vector<Measurement> first{run.measurements.front()};
    take_readings(
        log_of({measurement_mean(logs[r], late, first.front().kind, model.robot.cable_count())}),
        first);
    run.measurements.front() = first.front();
    any = true;
  }
  if (!any || !fit_with_noise(out)) return std::nullopt;
  return out;
}

}  // namespace cdprcal
