#include "cdprcal/calibration/allow_for_effects.hpp"

#include <algorithm>
#include <iterator>
#include <limits>

#include "cdprcal/effects/applied.hpp"
#include "cdprcal/estimation/presence.hpp"
#include "cdprcal/evidence/checks.hpp"
#include "cdprcal/evidence/directions.hpp"
#include "cdprcal/evidence/model_average.hpp"
#include "cdprcal/evidence/steps.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
DiagnosisModel model_of(const Calibration& calibration) {
  const CalibrationProblem& problem = calibration.problem;
  DiagnosisModel model;
  model.robot = problem.robot;
  DiagnosisRun& run = model.runs.emplace_back();
  // The reference and what rests: readings in motion lag and hang behind in ways of their own, and
  // a single sample of them would weigh as much as a rest.
  for (std::size_t i = 0; i < problem.measurements.size(); ++i) {
    const Measurement& m = problem.measurements[i];
    if (i > 0 && m.kind != PoseKind::static_pose) continue;
    run.measurements.push_back(m);
    run.poses.push_back(calibration.result.poses[i]);
  }
  run.known = problem.effects;
  run.offsets =
      offsets_at(with_effects(problem.robot, run.known), run.poses[0], run.measurements[0]);
  start_noise(model, calibration.signals);
  return model;
}

namespace {

/// Keeps witnesses of their own; how many readings still count as one.
double keep_witnesses(const Calibration& calibration, double moments_a_reading,
                      DiagnosisModel& model) {
  if (!(moments_a_reading > 1.0)) return 1.0;
  return thin_out(model.runs.front(), static_cast<std::size_t>(calibration.kinematic_poses),
                  moments_a_reading);
}

/// Effects that a misfit may come from: all that robots have a little of, and of the others those
/// that something speaks for, which come last.
struct ToAllowFor {
  Candidates usual, others;
};
ToAllowFor to_allow_for(const DiagnosisModel& model) {
  ToAllowFor out;
  Candidates others;
  for (const auto& effect : untried(model)) {
    (effect->info().all_or_nothing ? others : out.usual).push_back(effect);
  }
  DiagnosisModel fitted = model;
  if (!fit_with_noise(fitted)) return out;
  std::vector<CandidateScore> scores = scan(fitted, others, {.draws = 0});
  for (CandidateScore& step : first_step_scores(fitted)) scores.push_back(std::move(step));
  for (const CandidateScore& score : scores) {
    if (score.log_evidence > 0.0) out.others.push_back(score.effect);
  }
  return out;
}

/// Takes all of them into the model, free. Whether it settles: with what stands for the same in
/// many ways it may not; the usual ones alone then.
bool allow_for(const ToAllowFor& effects, DiagnosisModel& model) {
  const auto with = [](const Candidates& more, DiagnosisModel to) {
    const int cables = to.robot.cable_count();
    for (const auto& effect : more) {
      to.effects.push_back({effect, EffectValues::Zero(effect->size(cables))});
    }
    return to;
  };
  const DiagnosisModel usual = with(effects.usual, std::move(model));
  model = with(effects.others, usual);
  if (fit_with_noise(model)) return true;
  if (effects.others.empty()) return false;
  model = usual;
  return fit_with_noise(model);
}

/// The pose if the balance is as good as lengths and swivels show: as likely as the one that was
/// found with a balance as good as the robot file says, where residuals leave that open.
std::optional<Possibility> with_better_balance(const CalibrateOptions& options,
                                               const Calibration& calibration) {
  constexpr double kAsLikely = 0.5;
  if (calibration.problem.statics != StaticsModel::wrench) return std::nullopt;
  const CalibrationResult& found = calibration.result;
  const CalibrationResult other = refine(calibration.problem, found, calibration.signals,
                                         options.solve, BalanceError::as_geometry)
                                      .result;
  if (other.status != CalibrationStatus::converged || !other.covariance) return std::nullopt;
  return in_place_of({found.poses.front(), *found.covariance},
                     {other.poses.front(), *other.covariance}, kAsLikely);
}

/// With what the log cannot rule out, as diagnose has it before it finds anything.
struct WithUnseen {
  Matrix6 covariance;
  bool lacks_something = false;  ///< an effect is far more probable than that there is none
};
std::optional<WithUnseen> with_unseen(const Calibration& calibration, double moments_a_reading) {
  constexpr double kProbable = 0.95;  // 3 nats, as everywhere; less is in the covariance
  DiagnosisModel model = model_of(calibration);
  keep_witnesses(calibration, moments_a_reading, model);
  if (!fit_with_noise(model)) return std::nullopt;
  const std::vector<CandidateScore> scores = scan(model, untried(model), {.draws = 0});
  const Unseen unseen = unseen_effects(model, scores);
  Matrix6 own = *calibration.result.covariance +
                initial_pose_covariance(with_uncertain_noise(model), 0) -
                initial_pose_covariance(model, 0);
  if (!model.runs.front().known.empty()) own += uncertain_directions(model).covariance;
  // Of a platform that moves, directions are those of the readings, whose errors then look like
  // what friction and hysteresis do; diagnose tells the two apart.
  const bool moves = std::ranges::any_of(model.runs.front().measurements, &Measurement::moves);
  WithUnseen out{averaged_covariance(own, unseen, checks_of(model).enough())};
  // What the robot file says is no lack.
  const auto no_lack = [&](std::size_t k) {
    if (k >= scores.size()) return false;  // a step
    const Effect& effect = *scores[k].effect;
    return effect.is_stated(model.robot) || (moves && looks_at_directions(effect, model));
  };
  for (std::size_t k = 0; k < unseen.each.size(); ++k) {
    if (unseen.each[k].probability > kProbable && !no_lack(k)) out.lacks_something = true;
  }
  return out.covariance.allFinite() ? std::optional(out) : std::nullopt;
}

/// How much better or worse than its specification nobody knows a sensor without having seen it.
constexpr double kRoughly = 2.0;

/// In which channels poses misfit by more than single readings scatter and by more than so many
/// times what the robot file says.
std::string misfit_beyond(const Calibration& calibration, double times_specified) {
  if (!calibration.problem.noise) return {};
  const NoiseModel& noise = *calibration.problem.noise;
  std::string text;
  const auto add = [&](double pose, double sample, double at_least, double scale,
                       const std::string& pattern) {
    if (pose > std::max(sample, times_specified * at_least)) {
      add_item(text, printed(pattern.c_str(), scale * pose, scale * sample));
    }
  };
  // A channel that nothing measured, or too little to tell, keeps its specified noise.
  const NoiseModel specified = specified_noise(calibration.problem.robot.sigma);
  const ResidualRms& rms = calibration.result.residual_rms;
  for_each_channel(
      [&](const ChannelRow& row, double value) {
        const auto c = channel_of(row);
        const bool told = noise[c].pose != specified[c].pose ||
                          noise[c].sample.sigma != specified[c].sample.sigma;
        if (c == Channel::balance || !std::isfinite(value) || !told) return;
        const Quantity shown = quantity_of(row.of());
        const std::string in_unit = std::string("%.3g ") + shown.unit;
        const std::string scatter = text.empty() ? "they scatter by " : "";
        add(noise[c].pose, scatter_of(calibration.problem, c), specified[c].pose, shown.scale,
            row.plural + (" by " + in_unit) + " (" + scatter + in_unit + ")");
      },
      rms);
  if (std::isfinite(rms.wrench_force_N)) {
    // What the robot file allows the balance to be wrong by is no misfit.
    const double allowed_N = calibration.problem.robot.sigma.wrench_force_N;
    const double beyond_N = std::sqrt(
        std::max(0.0, noise.wrench_force_N * noise.wrench_force_N - allowed_N * allowed_N));
    if (reads_tensions(calibration.problem.measurements)) {
      // Accelerations are known so little where the platform moves that errors of the balance
      // beside them are any number: as large as what is missed, at most.
      const bool moves = std::ranges::any_of(calibration.problem.measurements, &Measurement::moves);
      const double most_N = moves ? rms.wrench_force_N : std::numeric_limits<double>::infinity();
      add(std::min(most_N, std::hypot(noise[Channel::balance].pose, beyond_N)),
          scatter_of(calibration.problem, Channel::balance), specified[Channel::balance].pose, 1.0,
          "the balance by %.3g N (tensions scatter by %.3g N)");
    } else {
      add(noise.wrench_force_N, 1.01 * allowed_N, allowed_N, 1.0,
          "the balance by %.3g N (the robot file allows %.3g N)");
    }
  }
  return text;
}

}  // namespace

std::string misfit(const Calibration& calibration) { return misfit_beyond(calibration, 0.0); }

double scatter_of(const CalibrationProblem& problem, Channel channel) {
  const double specified = specified_noise(problem.robot.sigma)[channel].pose;
  if (row_of(channel).of().is_inertial()) return 1.01 * specified;  // its bias is expected
  const double sample = problem.noise ? (*problem.noise)[channel].sample.sigma : 0.0;
  return sample > 0.0 ? sample : kRoughly * specified;
}

namespace {

/// allow_for_effects, of a fit that was made for it.
bool allow_for_all(Calibration& calibration, double moments_a_reading) {
  CalibrationResult& result = calibration.result;
  const std::string found = misfit(calibration);
  const std::optional<WithUnseen> unseen = with_unseen(calibration, moments_a_reading);
  result.lacks_something = unseen && unseen->lacks_something;
  // Errors that stay over a rest misfit, too: as large as a sensor may have them they are noise
  // until an effect explains them better. Without load cells columns exchanged do no more.
  const bool as_noise = unseen && !unseen->lacks_something &&
                        reads_tensions(calibration.problem.measurements) &&
                        misfit_beyond(calibration, kRoughly).empty();
  if (found.empty() || as_noise) {
    if (unseen) result.covariance = unseen->covariance;
    return true;
  }
  result.lacks_something = true;
  result.reason += "; yet the model misfits " + found +
                   ", so it lacks something (cdprcal diagnose looks for it)";
  DiagnosisModel model = model_of(calibration);
  const bool settled = allow_for(to_allow_for(model), model);
  DiagnosisModel witnesses = model;
  const double shared = keep_witnesses(calibration, moments_a_reading, witnesses);
  const Matrix6 covariance =
      shared * initial_pose_covariance(with_uncertain_noise(std::move(witnesses)), 0);
  if (!settled || !covariance.allFinite()) {
    if (unseen) result.covariance = unseen->covariance;  // of one effect at a time
    result.reason += ", and the uncertainty leaves that out";
    result.covariance_holds = false;
    return false;
  }
  std::size_t next = 0;
  for (std::size_t i = 0; i < result.poses.size(); ++i) {
    if (i > 0 && calibration.problem.measurements[i].kind != PoseKind::static_pose) continue;
    result.poses[i] = model.runs[0].poses[next++];
  }
  result.covariance = covariance;
  const PlatformState initial =
      platform_state(with_effects(model.robot, model.active(0)), model.runs[0].poses.front());
  result.initial_length_m = initial.length_m();
  result.initial_swivel_rad = initial.swivel_rad();
  result.reason +=
      "; the pose and its uncertainty allow for every known effect at its typical size";
  return true;
}

}  // namespace

bool allow_for_effects(const CalibrateOptions& options, Calibration& calibration,
                       double moments_a_reading) {
  constexpr double kFalseAlarm = 0.01;  // what diagnose takes for the chance of an accusation
  CalibrationResult& result = calibration.result;
  if (result.status != CalibrationStatus::converged) return true;
  if (!options.allow_for_effects || noise_source(options) != NoiseSource::from_data) {
    result.lacks_something = result.chi_square_p_value < kFalseAlarm;  // the σ that was specified
    return true;
  }
  const std::optional<Possibility> better = with_better_balance(options, calibration);
  if (!allow_for_all(calibration, moments_a_reading)) return false;
  if (better) {
    const Matrix6 covariance = averaged_covariance(*result.covariance, {*better});
    if (covariance.allFinite()) result.covariance = covariance;
  }
  return true;
}

}  // namespace cdprcal
