#include "cdprcal/calibration/calibrate.hpp"

#include <algorithm>

#include "cdprcal/calibration/allow_for_effects.hpp"
#include "cdprcal/calibration/initial_guess.hpp"
#include "cdprcal/calibration/measurements.hpp"
#include "cdprcal/calibration/multi_start.hpp"
#include "cdprcal/calibration/other_minima.hpp"
#include "cdprcal/calibration/shared_errors.hpp"
#include "cdprcal/calibration/unsettled_start.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/estimation/presence.hpp"
#include "cdprcal/readings/fresh.hpp"
#include "cdprcal/readings/log_checks.hpp"

namespace cdprcal {
namespace {

void check_fit(const Log& log, const CalibrateOptions& options) {
  const int cables = log.cable_count();
  if (options.method == Method::statics && log.tension_N.cols() == 0 && cables >= 6) {
    throw InputError(
        name_of(log) + ": the log has no tension_1_N … columns, without which rests on " +
        std::to_string(cables) + " cables say nothing for method static; use method kinematic");
  }
  if (!(options.kinematic_spacing_s > 0.0)) {
    throw InputError("kinematic_spacing_s must be positive");
  }
  if (options.most_starts < 1) {
    throw InputError("most_starts: is " + std::to_string(options.most_starts) + "; give 1 or more");
  }
  parse_method(to_string(options.method));  // throws for a number that is none
}

/// Whether any rest says how tensions balance, which tells minima far apart from each other.
bool is_balanced(const CalibrationProblem& problem) {
  const auto balanced = [](const Measurement& m) {
    return m.in_balance() && m.unread_tensions() == 0;
  };
  return problem.statics != StaticsModel::none &&
         std::any_of(problem.measurements.begin(), problem.measurements.end(), balanced);
}

/// As prepare. `start`: the samples that show the initial pose, where that is known.
Calibration prepare(const Robot& robot, const CorrectedRun& corrected,
                    const CalibrateOptions& options, const std::optional<SampleRange>& start) {
  const Log& log = corrected.log;
  check_fit(log, options);
  const SampleRange& run = corrected.rows;
  Calibration out;
  CalibrationProblem& problem = out.problem;
  problem.robot = robot;
  problem.effects = known_effects(robot, log, options);
  const bool paper = options.formulation == Formulation::paper;
  problem.statics = options.method == Method::kinematic ? StaticsModel::none
                    : paper                             ? StaticsModel::left_inverse
                                                        : StaticsModel::wrench;
  if (problem.statics == StaticsModel::left_inverse) {
    problem.left_inverse_rows = left_inverse_rows(robot.cable_count());
  }
  problem.reference_attitude = problem.reference_statics = problem.reference_noise = !paper;
  if (options.at_s.empty() && options.method != Method::kinematic) {
    out.equilibria = detect_equilibria(log, run, robot.sigma, options.detection);
  }
  out.signals = signals(log, run, out.equilibria, robot.sigma, options.detection.window_s);
  const PathState path = path_state(robot, log);
  // All that a row reads is to be of one time.
  const std::optional<Log> continuous = without_holds(log);
  const Log& read = continuous ? *continuous : log;
  if (options.at_s.empty()) {
    measure_automatically(read, path, run, options, start, out);
  } else {
    measure_by_hand(read, path, run, options, out);
  }
  if (noise_source(options) == NoiseSource::from_data) {
    out.gated = gate_slack(problem, out.signals);
  }
  out.reference_time_s = problem.measurements.front().time_s;
  for (const Measurement& m : problem.measurements) {
    (m.kind == PoseKind::static_pose ? out.static_poses : out.kinematic_poses) += 1;
  }
  return out;
}

}  // namespace

ActiveEffects known_effects(const Robot& robot, const Log& log, const CalibrateOptions& options) {
  ActiveEffects effects = resolve_effects(robot, log.source);
  effects.insert(effects.end(), options.happened.begin(), options.happened.end());
  return effects;
}

NoiseSource noise_source(const CalibrateOptions& options) {
  return options.noise.value_or(options.formulation == Formulation::paper ? NoiseSource::specified
                                                                          : NoiseSource::from_data);
}

void refine_in_place(const CalibrateOptions& options, Calibration& calibration) {
  if (noise_source(options) != NoiseSource::from_data) return;
  Refinement refined =
      refine(calibration.problem, calibration.result, calibration.signals, options.solve);
  calibration.problem = std::move(refined.problem);
  calibration.result = std::move(refined.result);
  auto& gated = calibration.gated;
  gated.insert(gated.end(), refined.gated.begin(), refined.gated.end());
}

CorrectedRun corrected_run(const Robot& robot, const Log& log, const CalibrateOptions& options) {
  const bool from_data = noise_source(options) == NoiseSource::from_data;
  return {robot, log, options.segment, from_data ? Outliers::left_out : Outliers::kept};
}

Calibration prepare(const Robot& robot, const Log& log, const CalibrateOptions& options) {
  return prepare(robot, corrected_run(robot, log, options), options, std::nullopt);
}

namespace {

/// A prepared calibration, solved from these poses.
Calibration fit_from(const std::vector<Pose>& guess, Calibration out,
                     const CalibrateOptions& options) {
  out.result = solve(out.problem, guess, options.solve);
  refine_in_place(options, out);
  leave_independent_moments(options, out);
  return out;
}

/// The rests of a prepared calibration and the sample that it starts from.
Calibration without_motion(Calibration prepared) {
  auto& measurements = prepared.problem.measurements;
  measurements.erase(
      std::remove_if(measurements.begin() + 1, measurements.end(),
                     [](const Measurement& m) { return m.kind == PoseKind::kinematic_pose; }),
      measurements.end());
  prepared.kinematic_poses = measurements.front().kind == PoseKind::kinematic_pose ? 1 : 0;
  return prepared;
}

Calibration fit(Calibration out, const CalibrateOptions& options);

/// Where no start agrees: all poses from where the rests are, whose minima are fewer; without
/// several of them from starts all over the workspace.
void look_by_rests(const Calibration& prepared, const CalibrateOptions& options,
                   CalibrationResult& found) {
  const CalibrationProblem& problem = prepared.problem;
  Calibration still = without_motion(prepared);
  const bool moves = still.problem.measurements.size() < problem.measurements.size();
  if (!moves || prepared.static_poses < kSeveral) {
    found = solve_from_anywhere(problem, options.solve, std::move(found));
    return;
  }
  const CalibrationResult rests = fit(std::move(still), options).result;
  double solve_time_s = found.solve_time_s + rests.solve_time_s;
  if (rests.status == CalibrationStatus::converged || rests.curved) {
    CalibrationResult whole =
        solve(problem,
              measurement_guesses(problem.robot, problem.measurements, rests.poses.front(),
                                  problem.effects, RestGuess::estimated, rests.poses),
              options.solve);
    solve_time_s += whole.solve_time_s;
    if (whole.status != CalibrationStatus::not_converged) found = std::move(whole);
  }
  found.solve_time_s = solve_time_s;
}

/// Where no start agrees: from where geometry alone has the poses. A weight that is wrong by much
/// makes poses out of tensions that none of the others is near.
void look_without_balance(const CalibrationProblem& problem, const CalibrateOptions& options,
                          CalibrationResult& found) {
  CalibrationProblem geometry = problem;
  geometry.statics = StaticsModel::none;
  const CalibrationResult by_geometry =
      solve_from_starts(geometry, std::nullopt, options.most_starts, options.solve);
  double solve_time_s = found.solve_time_s + by_geometry.solve_time_s;
  if (by_geometry.status == CalibrationStatus::converged) {
    CalibrationResult whole = solve(problem, by_geometry.poses, options.solve);
    solve_time_s += whole.solve_time_s;
    if (whole.cost < found.cost) found = std::move(whole);
  }
  found.solve_time_s = solve_time_s;
}

/// A prepared calibration, solved; without words on it.
Calibration fit(Calibration out, const CalibrateOptions& options) {
  const CalibrationProblem& problem = out.problem;
  if (options.guess.size() == problem.measurements.size()) {
    return fit_from(options.guess, std::move(out), options);
  }
  if (options.guess.size() > 1) {
    throw InputError("guess: " + std::to_string(options.guess.size()) + " poses given for " +
                     std::to_string(problem.measurements.size()) +
                     " measurements; give one a measurement, or the initial pose alone");
  }
  const std::optional<Pose> initial =
      options.guess.empty() ? std::nullopt : std::optional<Pose>(options.guess.front());
  const Calibration prepared = out;
  std::vector<CalibrationResult> ends;
  out.result = solve_from_starts(problem, initial, options.most_starts, options.solve, &ends);
  if (!initial && options.most_starts > 1 &&
      out.result.status == CalibrationStatus::not_converged) {
    if (is_balanced(problem)) {
      look_without_balance(problem, options, out.result);
    } else {
      look_by_rests(prepared, options, out.result);
    }
  }
  const CalibrationResult first = out.result;
  refine_in_place(options, out);
  const bool doubtful = !is_balanced(problem) ||
                        (noise_source(options) == NoiseSource::from_data && looks_wrong(out));
  if (!initial && options.most_starts > 1 && options.formulation == Formulation::full &&
      (first.status == CalibrationStatus::converged || first.curved) && doubtful) {
    look_elsewhere(options, prepared, first, std::move(ends), out);
  }
  leave_independent_moments(options, out);
  return out;
}

/// The same, held against what its neighbourhood says.
Calibration fit_and_look(const Calibration& prepared, const CalibrateOptions& options) {
  Calibration out = fit(prepared, options);
  look_around(out.problem, out.result);
  return out;
}

/// The same; by geometry alone where rests without load cells, exact but curved, leave open how
/// well the pose is known; from there where they find none.
Calibration fit_either(const Calibration& prepared, const CalibrateOptions& options) {
  Calibration out = fit_and_look(prepared, options);
  if (out.result.status == CalibrationStatus::converged || options.method != Method::unified ||
      prepared.problem.statics != StaticsModel::wrench ||
      reads_tensions(prepared.problem.measurements)) {
    return out;
  }
  Calibration geometry = prepared;
  geometry.problem.statics = StaticsModel::none;
  geometry = fit_and_look(geometry, options);
  if (geometry.result.status != CalibrationStatus::converged) return out;
  if (out.result.status != CalibrationStatus::not_converged) return geometry;
  // Rests contradicted each other where they were fitted. Where geometry says the platform is they
  // may well balance; if not there either, it is one of geometry's minima, and not the pose.
  // By what geometry was found by: of the moments in motion that may be fewer than were prepared.
  Calibration there = geometry;
  there.problem.statics = prepared.problem.statics;
  there.problem.noise = prepared.problem.noise;
  there = fit_from(geometry.result.poses, std::move(there), options);
  look_around(there.problem, there.result);
  const bool balances = there.result.status == CalibrationStatus::converged &&
                        !is_far(minus(there.result.poses.front(), geometry.result.poses.front()),
                                *geometry.result.covariance);
  return balances ? there : out;
}

/// The same; by its rests alone where the moments in motion contradict them: where one sensor is
/// late they do so while the platform moves, and nowhere else.
Calibration fit_rests_at_least(const Calibration& prepared, const CalibrateOptions& options) {
  Calibration out = fit_either(prepared, options);
  if (out.result.status != CalibrationStatus::not_converged || options.method != Method::unified ||
      prepared.static_poses < kSeveral || options.guess.size() > 1 ||
      prepared.kinematic_poses == 0 || !is_balanced(prepared.problem)) {
    return out;
  }
  Calibration rests = fit_and_look(without_motion(prepared), options);
  if (rests.result.status != CalibrationStatus::converged) return out;
  rests.motion_left_out = true;
  return rests;
}

/// Again with what shows the initial pose better than the first sample, where something does.
Calibration fit_settled(const Robot& robot, const Log& log, const CalibrateOptions& options) {
  const CorrectedRun run = corrected_run(robot, log, options);
  Calibration out = fit_rests_at_least(prepare(robot, run, options, std::nullopt), options);
  if (!options.at_s.empty() || options.formulation == Formulation::paper) return out;
  const std::optional<SampleRange> start =
      unsettled_start(run.log, run.rows, out, options.detection.window_s);
  return start ? fit_rests_at_least(prepare(robot, run, options, start), options) : out;
}

}  // namespace

Calibration calibrate(const Robot& robot, const Log& log, const CalibrateOptions& options) {
  CalibrateOptions silent = options;  // of several fits only the last is explained
  silent.solve.explain = false;
  Calibration out = fit_settled(robot, log, silent);
  allow_for_effects(options, out);
  if (options.solve.explain) explain(out.problem, out.result);
  if (out.motion_left_out) {
    out.result.reason += "; moments in motion contradict the rests and do not count";
  }
  return out;
}

Method parse_method(const std::string& name) {
  if (name == "unified") return Method::unified;
  if (name == "static") return Method::statics;
  if (name == "kinematic") return Method::kinematic;
  throw InputError("method: '" + name + "' is not one of unified, static, kinematic");
}

Formulation parse_formulation(const std::string& name) {
  if (name == "full") return Formulation::full;
  if (name == "paper") return Formulation::paper;
  throw InputError("formulation: '" + name + "' is not one of full, paper");
}

NoiseSource parse_noise_source(const std::string& name) {
  if (name == "data") return NoiseSource::from_data;
  if (name == "specified") return NoiseSource::specified;
  throw InputError("noise: '" + name + "' is not one of data, specified");
}

const char* to_string(NoiseSource source) {
  return source == NoiseSource::specified ? "specified" : "data";
}

const char* to_string(Method method) {
  switch (method) {
    case Method::unified:
      return "unified";
    case Method::statics:
      return "static";
    case Method::kinematic:
      return "kinematic";
  }
  return "unknown";
}

const char* to_string(Formulation formulation) {
  return formulation == Formulation::paper ? "paper" : "full";
}

}  // namespace cdprcal
