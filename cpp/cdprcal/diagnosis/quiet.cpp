#include "cdprcal/diagnosis/quiet.hpp"

#include <algorithm>
#include <cmath>

#include "cdprcal/diagnosis/model_residuals.hpp"
#include "cdprcal/readings/path_state.hpp"
#include "cdprcal/readings/turn_over.hpp"

namespace cdprcal {
namespace {

/// Of the difference of two readings: errors give it the wrong sign once in 30,000.
constexpr double kSure = 4.0;

double dead_band(const DiagnosisModel& model, Channel channel) {
  const auto group = static_cast<std::size_t>(at_rest(channel));
  const double noise = model.noise[group], ripple = model.floor[group];
  return kSure * std::sqrt(2.0 * std::max(0.0, noise * noise - ripple * ripple));
}

void give_up(const CableVector& moved, double least, CableVector& s) {
  for (Eigen::Index c = 0; c < s.size(); ++c) {
    if (std::abs(moved[c]) <= least) s[c] = 0.0;
  }
}

/// Whether any direction may have changed.
bool make_directions_sure(DiagnosisModel& model, const std::vector<Log>& logs) {
  PathDeadBands least{dead_band(model, Channel::length), dead_band(model, Channel::swivel)};
  // What turns over within the band anyway.
  if (!(least.length_m > turn_over_m(model.robot))) least.length_m = 0.0;
  if (!(least.swivel_rad > kTurnOver_rad)) least.swivel_rad = 0.0;
  if (logs.empty() || (least.length_m == 0.0 && least.swivel_rad == 0.0)) return false;
  for (std::size_t r = 0; r < model.runs.size(); ++r) {
    DiagnosisRun& run = model.runs[r];
    const PathState path = path_state(model.robot, logs[r], kPathSmoothing_s, least);
    const Robot robot = with_effects(model.robot, model.active(r));
    PlatformState before = platform_state(robot, run.poses.front());
    for (std::size_t i = 0; i < run.measurements.size(); ++i) {
      Measurement& m = run.measurements[i];
      if (is_moving(m) || m.moves()) continue;
      Measurement found = m;
      add_path(path, logs[r], run.rows[i], 0.0, found);
      const PlatformState now = platform_state(robot, run.poses[i]);
      if (least.length_m > 0.0) {
        m.length_direction = found.length_direction;
        give_up(now.length_m() - before.length_m(), least.length_m, m.length_direction);
      }
      if (least.swivel_rad > 0.0) {
        m.swivel_direction = found.swivel_direction;
        give_up((now.swivel_rad() - before.swivel_rad()).unaryExpr(&wrap_angle), least.swivel_rad,
                m.swivel_direction);
      }
      before = now;
    }
  }
  return true;
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
  make_directions_sure(model, logs);
  fit_with_noise(model);
  return model;
}

std::optional<DiagnosisModel> with_sure_directions(const DiagnosisModel& model,
                                                   const std::vector<Log>& logs) {
  DiagnosisModel out = model;
  if (!make_directions_sure(out, logs) || !fit_with_noise(out)) return std::nullopt;
  return out;
}

bool looks_at_directions(const Effect& effect, const DiagnosisModel& model) {
  const DiagnosisRun& run = model.runs.front();
  const PlatformState state = platform_state(model.robot, run.poses.front());
  const EffectValues typical = effect.typical(model.robot);
  const auto columns = [&](double direction) {
    Measurement m = run.measurements.front();
    m.length_direction.setConstant(model.robot.cable_count(), direction);
    m.swivel_direction.setConstant(model.robot.cable_count(), direction);
    Eigen::MatrixXd out =
        Eigen::MatrixXd::Zero(ReadingRows{model.robot.cable_count()}.size(), typical.size());
    effect.columns({model.robot, state, run.poses.front(), m}, EffectValues::Zero(typical.size()),
                   out);
    return Eigen::MatrixXd(out.array().isNaN().select(0.0, out));
  };
  return columns(1.0) != columns(-1.0);
}

}  // namespace cdprcal
