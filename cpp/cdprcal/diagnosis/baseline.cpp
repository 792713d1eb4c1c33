#include "cdprcal/diagnosis/baseline.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cdprcal/calibration/calibrate.hpp"
#include "cdprcal/calibration/refine.hpp"
#include "cdprcal/calibration/shared_errors.hpp"
#include "cdprcal/diagnosis/events.hpp"
#include "cdprcal/effects/applied.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/motion/calibrate_in_motion.hpp"
#include "cdprcal/readings/log_checks.hpp"

namespace cdprcal {
namespace {

/// The rows behind each measurement: those of the next rest, or one; moments in motion come last.
std::vector<SampleRange> rows_of(const Log& log, const Calibration& calibration, int moments) {
  std::vector<SampleRange> out;
  auto rest = calibration.equilibria.begin();
  const auto& measurements = calibration.problem.measurements;
  for (const Measurement& m : measurements) {
    const bool moment = out.size() + static_cast<std::size_t>(moments) >= measurements.size();
    if (!moment && m.kind == PoseKind::static_pose && rest != calibration.equilibria.end()) {
      out.push_back(rest++->samples);
      continue;
    }
    const double* begin = log.time_s.data();
    const Eigen::Index row = std::lower_bound(begin, begin + log.time_s.size(), m.time_s) - begin;
    out.push_back({row, row + 1});
  }
  return out;
}

/// The calibration that a run starts from. Rests where there are some, load cells or not: samples
/// in motion share their errors with their neighbours, and the diagnosis would take each for a
/// witness of its own.
Calibration start_of(const Robot& robot, const Log& log, bool motion) {
  CalibrateOptions options;
  options.noise = NoiseSource::specified;  // the diagnosis has its own, with the effects in it
  options.method = Method::statics;
  if (log.tension_N.cols() > 0) {
    Calibration at_rest = calibrate(robot, log, options);
    if (!motion || at_rest.static_poses > 0) return at_rest;
  }
  options.method = Method::unified;
  options.kinematic_spacing_s = std::numeric_limits<double>::infinity();  // none but the reference
  Calibration at_rest = calibrate(robot, log, options);
  if (at_rest.result.status == CalibrationStatus::not_converged ||
      at_rest.result.status == CalibrationStatus::unobservable) {
    // Without load cells rests alone have minima in which cables would push, and seem to leave a
    // direction open; the noise that the readings show tells the right one from them where the
    // specified is many times as large.
    CalibrateOptions with_noise_found = options;
    with_noise_found.noise = NoiseSource::from_data;
    with_noise_found.allow_for_effects = false;
    Calibration other = calibrate(robot, log, with_noise_found);
    if (other.result.status == CalibrationStatus::converged) return other;
  }
  if (at_rest.result.status != CalibrationStatus::unobservable) return at_rest;
  options.method = Method::kinematic;
  options.kinematic_spacing_s = CalibrateOptions().kinematic_spacing_s;
  return calibrate(robot, log, options);
}

/// Poses of a log as a run with its calibrated start; and how its samples come.
DiagnosisRun run_from(const Robot& robot, const Log& log, bool motion,
                      std::vector<std::string>& left_out, Signals& signals) {
  InMotion start;
  const InMotionOptions as_fitted = for_a_search();
  if (motion) start = calibrate_in_motion(robot, log, as_fitted);
  if (!start.in_motion) start.calibration = start_of(robot, log, motion);
  Calibration& calibration = start.calibration;
  if (calibration.result.poses.empty()) {
    throw InputError(name_of(log) + ": the baseline calibration failed: " +
                     calibration.result.reason + "; run cdprcal check");
  }
  gate_slack(calibration.problem, calibration.signals);
  DiagnosisRun run;
  signals = calibration.signals;
  run.name = log.source;
  run.measurements = calibration.problem.measurements;
  run.poses = calibration.result.poses;
  run.rows = rows_of(log, calibration, start.in_motion ? calibration.kinematic_poses : 0);
  if (start.in_motion && !start.pushes.empty()) {
    left_out.push_back(name_of(log) + ": what the platform balances at " + in_words(start.pushes) +
                       ": something pushes it there, for it gains energy while the winches stand "
                       "still");
  }
  const auto moments = static_cast<std::size_t>(calibration.kinematic_poses);
  if (start.in_motion) {
    thin_out(run, moments, start.moments_a_reading);
  } else if (moments > 1) {  // no rest tells, and the first is the reference
    const std::size_t later = moments - 1;
    thin_out(run, later, moments_a_reading(calibration.result.residuals, later));
  }
  run.known = calibration.problem.effects;
  // What the calibration found to make its path by is still to be named.
  std::erase_if(run.known, [&](const ActiveEffect& active) {
    return std::ranges::find(start.beside.late, active.effect, &ActiveEffect::effect) !=
           start.beside.late.end();
  });
  run.offsets = offsets_at(with_effects(robot, run.known), run.poses[0], run.measurements[0]);
  return run;
}

}  // namespace

DiagnosisModel baseline_model(const Robot& robot, std::vector<Log>& logs,
                              std::vector<std::string>& left_out, bool motion) {
  DiagnosisModel model;
  model.robot = robot;
  Signals all{};
  for (Log& log : logs) {
    for (const LogEvent& event : gate_events(robot, log)) {
      left_out.push_back(name_of(log) + ": " + describe(event));
    }
    const auto before = static_cast<double>(model.runs.size());
    Signals own;
    model.runs.push_back(run_from(robot, log, motion, left_out, own));
    all = mixed(all, before, own, 1.0);
  }
  start_noise(model, all);
  if (!fit_with_noise(model)) {
    left_out.emplace_back("the baseline fit did not settle: results are to be taken with care");
  }
  return model;
}

}  // namespace cdprcal
