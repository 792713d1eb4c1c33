#include "cdprcal/calibration/calibrate.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cstdio>

#include "cdprcal/calibration/allow_for_effects.hpp"
#include "cdprcal/calibration/initial_guess.hpp"
#include "cdprcal/calibration/multi_start.hpp"
#include "cdprcal/calibration/unsettled_start.hpp"
#include "cdprcal/effects/corrected_run.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/estimation/presence.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/readings/fresh.hpp"
#include "cdprcal/readings/log_checks.hpp"
#include "cdprcal/readings/odd_readings.hpp"
#include "cdprcal/readings/still.hpp"

namespace cdprcal {
namespace {

std::string seconds(double time_s) {
  char text[32];
  std::snprintf(text, sizeof text, std::abs(time_s) < 1e12 ? "%.3f s" : "%g s", time_s);
  return text;
}

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

/// Row of the sample nearest to a time picked by hand; it must be there.
Eigen::Index row_at(const Log& log, const SampleRange& run, double time_s) {
  const double* begin = log.time_s.data() + run.begin;
  const double* end = log.time_s.data() + run.end;
  const double* after = std::lower_bound(begin, end, time_s);
  const double* nearest = after == end ? after - 1 : after;
  if (nearest != begin && std::abs(*(nearest - 1) - time_s) < std::abs(*nearest - time_s))
    --nearest;
  const double spacing =
      run.size() > 1 ? (*(end - 1) - *begin) / static_cast<double>(run.size() - 1) : 0.0;
  if (!(std::abs(*nearest - time_s) <= std::max(spacing, 1e-3))) {
    throw InputError(name_of(log) + ": no sample at " + seconds(time_s) + "; the run lasts from " +
                     seconds(*begin) + " to " + seconds(*(end - 1)) + "; choose a time within");
  }
  return run.begin + (nearest - begin);
}

void measure_by_hand(const Log& log, const PathState& path, const SampleRange& run,
                     const CalibrateOptions& options, Calibration& out) {
  const PoseKind kind =
      options.method == Method::kinematic ? PoseKind::kinematic_pose : PoseKind::static_pose;
  std::vector<Eigen::Index> rows;
  for (const double time_s : options.at_s) {
    const Eigen::Index row = row_at(log, run, time_s);
    if (std::find(rows.begin(), rows.end(), row) != rows.end()) {
      throw InputError("at: " + seconds(time_s) +
                       " names a sample that is named already; leave it out");
    }
    rows.push_back(row);
    out.problem.measurements.push_back(
        measurement_at(log, row, kind, out.problem.robot.cable_count()));
    add_path(path, log, {row, row + 1}, log.time_s[run.begin], out.problem.measurements.back());
  }
}

/// Whether any tension set-point differs from that of the sample before. NaN: not logged.
bool setpoint_changes(const Log& log, Eigen::Index row) {
  const LogMatrix& setpoints = log.tension_setpoint_N;
  for (Eigen::Index c = 0; c < setpoints.cols(); ++c) {
    const double step = std::abs(setpoints(row, c) - setpoints(row - 1, c));
    if (step > 1e-9 * (1.0 + std::abs(setpoints(row, c)))) return true;
  }
  return false;
}

/// Longest part of a rest over which no tension set-point changes.
SampleRange longest_hold(const Log& log, const SampleRange& rest) {
  SampleRange longest{rest.begin, rest.begin}, now = longest;
  for (Eigen::Index row = rest.begin; row < rest.end; ++row) {
    if (row > rest.begin && setpoint_changes(log, row)) now.begin = row;
    now.end = row + 1;
    if (now.size() > longest.size()) longest = now;
  }
  return longest;
}

/// Whether cables creep so slowly that forces balance all the same: encoders may show hundredths of
/// a millimetre of it, which single samples call a motion.
bool creeps(const Log& log, const SampleRange& beginning, double gravity_m_s2) {
  constexpr double kNegligible = 0.001;  // of the weight
  if (log.length_m.cols() == 0) return false;
  const double time_s = log.time_s[beginning.end - 1] - log.time_s[beginning.begin];
  const double change_m = (log.length_m.row(beginning.end - 1) - log.length_m.row(beginning.begin))
                              .cwiseAbs()
                              .maxCoeff();
  return change_m < kNegligible * gravity_m_s2 * time_s * time_s;
}

/// The samples that show where the platform was at the first one: up to the end of the first rest,
/// no further than the first change of a set-point (if they are held for half a window at all), and
/// only as long as no mean wanders. Nothing where it moves at once.
std::optional<SampleRange> start(const Log& log, const SampleRange& run, const Equilibrium& rest,
                                 double window_s, const Signals& signals, double gravity_m_s2) {
  SampleRange out{run.begin, rest.samples.end};
  Eigen::Index hold = run.begin + 1;
  while (hold < out.end && !setpoint_changes(log, hold)) ++hold;
  if (log.time_s[hold - 1] - log.time_s[run.begin] >= 0.5 * window_s) out.end = hold;
  const SampleRange still = at_the_start(log, out, signals);
  const SampleRange few{out.begin, std::min(out.end, out.begin + kFewestStill)};
  if (still.size() >= few.size()) return still;
  return creeps(log, few, gravity_m_s2) ? std::optional(few) : std::nullopt;
}

/// The samples of a rest that are averaged: its inner part. Where set-points are logged and held
/// for half of the rest or for half a window, that part counts: while they change nothing rests.
SampleRange core(const Log& log, const SampleRange& run, const Equilibrium& rest, double window_s) {
  if (log.tension_setpoint_N.cols() > 0) {
    const SampleRange hold = longest_hold(log, rest.samples);
    const double held_s = log.time_s[hold.end - 1] - log.time_s[hold.begin];
    if (2 * hold.size() >= rest.samples.size() || held_s >= 0.5 * window_s) return hold;
  }
  return inner_part(log, run, rest, window_s);
}

/// Whether the run began in this, its first rest. A test of many windows fails one now and then: a
/// rest found within two windows of the start holds the first sample too, unless a set-point
/// changed before it or the readings wandered.
bool holds_the_start(const Log& log, const SampleRange& run, const Equilibrium& rest,
                     double window_s, const Signals& signals) {
  if (rest.samples.begin == run.begin) return true;
  if (rest.begin_s - log.time_s[run.begin] > 2.0 * window_s) return false;
  const SampleRange until{run.begin, rest.samples.begin + 1};
  if (longest_hold(log, until).size() != until.size()) return false;
  // As much of the rest again, where it is that long: a motion before it would show against that.
  const SampleRange around{run.begin, std::min(rest.samples.end, run.begin + 2 * until.size())};
  return still_since_start(log, around, signals).end >= until.end;
}

/// `given`: the samples that show the initial pose, where that is known.
void measure_automatically(const Log& log, const PathState& path, const SampleRange& run,
                           const CalibrateOptions& options, const std::optional<SampleRange>& given,
                           Calibration& out) {
  const Robot& robot = out.problem.robot;
  const int n = robot.cable_count();
  auto& measurements = out.problem.measurements;
  std::vector<char> used(static_cast<std::size_t>(run.size()), 0);
  const auto mark = [&](const SampleRange& samples) {
    std::fill(used.begin() + (samples.begin - run.begin), used.begin() + (samples.end - run.begin),
              1);
  };
  const double window_s = options.detection.window_s;
  bool starts_at_rest = false;
  for (const Equilibrium& rest : out.equilibria) {
    SampleRange samples = core(log, run, rest, window_s);
    const bool given_here = given && given->begin < rest.samples.end;
    if (measurements.empty() &&
        (given_here || holds_the_start(log, run, rest, window_s, out.signals))) {
      const std::optional<SampleRange> first =
          !given_here ? start(log, run, rest, window_s, out.signals, robot.gravity_m_s2)
          : given->size() >= kFewestStill ? given
                                          : std::nullopt;
      starts_at_rest = first.has_value();
      if (starts_at_rest) samples = *first;
    }
    measurements.push_back(measurement_mean(log, samples, PoseKind::static_pose, n));
    add_path(path, log, samples, log.time_s[run.begin], measurements.back());
    mark({measurements.size() == 1 && starts_at_rest ? run.begin : rest.samples.begin,
          rest.samples.end});
  }
  if (!starts_at_rest) {
    const SampleRange samples = given.value_or(SampleRange{run.begin, run.begin + 1});
    measurements.insert(measurements.begin(),
                        measurement_mean(log, samples, PoseKind::kinematic_pose, n));
    add_path(path, log, samples, log.time_s[run.begin], measurements.front());
    mark({run.begin, samples.end});
  }
  measurements.front().time_s = log.time_s[run.begin];  // the reference is the first sample
  if (options.method == Method::statics) return;

  const double lever_m = characteristic_length_m(robot);
  double last = log.time_s[run.begin];
  std::vector<Measurement> moving;
  for (Eigen::Index row = run.begin; row < run.end; ++row) {
    if (used[static_cast<std::size_t>(row - run.begin)]) continue;
    if (log.time_s[row] - last < options.kinematic_spacing_s - 1e-9) continue;
    last = log.time_s[row];
    Measurement m = measurement_at(log, row, PoseKind::kinematic_pose, n);
    leave_out_impossible(log, row, robot.gravity_m_s2, lever_m, m);
    if (spare_readings(m, freedoms(robot)) < 1) continue;  // it would only add unknowns
    moving.push_back(std::move(m));
    add_path(path, log, {row, row + 1}, log.time_s[run.begin], moving.back());
  }
  const auto by_time = [](const Measurement& a, const Measurement& b) {
    return a.time_s < b.time_s;
  };
  measurements.insert(measurements.end(), moving.begin(), moving.end());
  std::stable_sort(measurements.begin() + 1, measurements.end(), by_time);
}

/// Puts the noise that the readings show in place of the specified one, and leaves out what does
/// not belong; nothing happens to a fit that is not to be trusted anyway.
void refine_in_place(const CalibrateOptions& options, Calibration& out) {
  if (noise_source(options) != NoiseSource::from_data) return;
  Refinement refined = refine(out.problem, out.result, out.signals, options.solve, options.refine);
  out.problem = std::move(refined.problem);
  out.result = std::move(refined.result);
  out.gated.insert(out.gated.end(), refined.gated.begin(), refined.gated.end());
}

/// Whether a fit may stand at a wrong minimum: poses misfit a geometric reading by more than it
/// scatters, which a wrong model does as well; or nothing says how much it may.
bool looks_wrong(const Calibration& calibration) {
  if (!calibration.problem.noise) return true;
  const NoiseModel& noise = *calibration.problem.noise;
  for (std::size_t c = 0; c < kChannels; ++c) {
    const auto channel = static_cast<Channel>(c);
    if (channel == Channel::balance || !is_read(calibration.problem, channel)) continue;
    if (noise[channel].pose > scatter_of(calibration.problem, channel)) return true;
  }
  return false;
}

/// Takes back the claim of a pose: another, `apart` from it, fits about as well.
void leave_open(const Vector6& apart, Calibration& out) {
  char text[240];
  std::snprintf(text, sizeof text,
                "another initial pose fits the readings about as well, %.3g mm and %.3g deg away; "
                "measure at more varied poses, or with more sensors",
                1e3 * apart.head<3>().norm(), apart.tail<3>().norm() / kDegree);
  withdraw(out.problem, text, out.result);
}

constexpr double kFar = 6.0;  // σ: beyond what a fit calls possible

bool is_far(const Vector6& apart, const Matrix6& covariance) {
  const double square = apart.dot(covariance.completeOrthogonalDecomposition().solve(apart));
  return square >= kFar * kFar;
}

/// How far another minimum is from one, where it fits about as well and is beyond what the one
/// calls possible. The other fit may have stopped short of its minimum: then it fits better still.
std::optional<Vector6> rivalled(const CalibrationResult& one, const CalibrationResult& other) {
  if (!one.covariance || other.poses.empty()) return std::nullopt;
  if (!(other.cost - one.cost < kDecisive)) return std::nullopt;
  const Vector6 apart = minus(other.poses.front(), one.poses.front());
  return is_far(apart, *one.covariance) ? std::optional(apart) : std::nullopt;
}

/// Few readings leave several minima, and a specified noise beyond the true one accepts all: the
/// lowest of all starts takes the place of the first, also where it is not to be trusted; and no
/// pose is claimed where another fits about as well. `prepared`: as it was before the fit; `ends`:
/// of the starts that it took.
void look_elsewhere(const CalibrateOptions& options, const Calibration& prepared,
                    const CalibrationResult& first, std::vector<CalibrationResult> ends,
                    Calibration& out) {
  std::vector<CalibrationResult> minima =
      minima_from_starts(prepared.problem, options.most_starts, options.solve, std::move(ends));
  if (minima.empty()) return;
  out.result.solve_time_s += minima.front().solve_time_s;
  const bool elsewhere = !same_minimum(first, minima.front()) && minima.front().cost < first.cost;
  const CalibrationResult& origin = elsewhere ? minima.front() : first;  // with the noise specified
  if (elsewhere) {
    const double solve_time_s = out.result.solve_time_s;
    out = prepared;
    out.result = origin;
    out.result.solve_time_s = solve_time_s;
    refine_in_place(options, out);
  }
  if (out.result.status != CalibrationStatus::converged) return;
  for (const CalibrationResult& other : minima) {
    if (const auto apart = rivalled(origin, other)) return leave_open(*apart, out);
  }
  // A valley that is one minimum with the noise specified may be several with the one found, which
  // starts at the bottom do not leave: all poses are lifted over its walls together.
  std::vector<std::vector<Pose>> starts;
  for (CalibrationResult& other : minima) starts.push_back(std::move(other.poses));
  const Eigen::SelfAdjointEigenSolver<Matrix6> spread(*out.result.covariance);
  const Vector6 least = kFar * std::sqrt(spread.eigenvalues()[5]) * spread.eigenvectors().col(5);
  for (const Vector6& move : {least, Vector6(-least)}) {
    std::vector<Pose>& start = starts.emplace_back();
    for (const Pose& pose : out.result.poses) start.push_back(plus(pose, move));
  }
  // Nor do they where lengths alone show the attitude: valleys lie a turn of the platform apart.
  const Pose& found = out.result.poses.front();
  if (kept_upright(out.problem, found)) {
    for (const double turn_deg : {15.0, -15.0, 30.0, -30.0}) {
      for (int axis = 0; axis < 3; ++axis) {
        Vector6 turn = Vector6::Zero();
        turn[3 + axis] = turn_deg * kDegree;
        starts.push_back(measurement_guesses(out.problem.robot, out.problem.measurements,
                                             plus(found, turn), out.problem.effects));
      }
    }
  }
  for (const std::vector<Pose>& start : starts) {
    const CalibrationResult again =
        solve_unless_hopeless(out.problem, start, options.solve, out.result.cost);
    out.result.solve_time_s += again.solve_time_s;
    if (const auto apart = rivalled(out.result, again)) return leave_open(*apart, out);
  }
}

/// Whether any rest says how tensions balance, which tells minima far apart from each other.
bool is_balanced(const CalibrationProblem& problem) {
  const auto balanced = [](const Measurement& m) {
    return m.in_balance() && m.unread_tensions() == 0;
  };
  return problem.statics != StaticsModel::none &&
         std::any_of(problem.measurements.begin(), problem.measurements.end(), balanced);
}

}  // namespace

NoiseSource noise_source(const CalibrateOptions& options) {
  return options.noise.value_or(options.formulation == Formulation::paper ? NoiseSource::specified
                                                                          : NoiseSource::from_data);
}

namespace {

/// As prepare. `start`: the samples that show the initial pose, where that is known.
Calibration prepare(const Robot& robot, const Log& given, const CalibrateOptions& options,
                    const std::optional<SampleRange>& start) {
  const CorrectedRun corrected(robot, given, options.segment);
  check_fit(given, options);
  const Log& log = corrected.log;
  const SampleRange& run = corrected.rows;
  Calibration out;
  CalibrationProblem& problem = out.problem;
  problem.robot = robot;
  problem.effects = resolve_effects(robot, log.source);
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
    const Signal& tension = out.signals[static_cast<std::size_t>(Channel::balance)];
    out.gated = gate_slack(problem, tension.sigma * std::sqrt(tension.rows));
  }
  out.reference_time_s = problem.measurements.front().time_s;
  for (const Measurement& m : problem.measurements) {
    (m.kind == PoseKind::static_pose ? out.static_poses : out.kinematic_poses) += 1;
  }
  return out;
}

}  // namespace

Calibration prepare(const Robot& robot, const Log& log, const CalibrateOptions& options) {
  return prepare(robot, log, options, std::nullopt);
}

namespace {

/// A prepared calibration, solved; without words on it.
Calibration fit(Calibration out, const CalibrateOptions& options) {
  const CalibrationProblem& problem = out.problem;
  if (options.guess.size() == problem.measurements.size()) {
    out.result = solve(problem, options.guess, options.solve);
    refine_in_place(options, out);
    return out;
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
  const CalibrationResult first = out.result;
  refine_in_place(options, out);
  const bool doubtful = !is_balanced(problem) ||
                        (noise_source(options) == NoiseSource::from_data && looks_wrong(out));
  if (!initial && options.most_starts > 1 && options.formulation == Formulation::full &&
      (first.status == CalibrationStatus::converged || first.curved) && doubtful) {
    look_elsewhere(options, prepared, first, std::move(ends), out);
  }
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
  Calibration there = prepared;
  there.result = solve(prepared.problem, geometry.result.poses, options.solve);
  refine_in_place(options, there);
  look_around(there.problem, there.result);
  const bool balances = there.result.status == CalibrationStatus::converged &&
                        !is_far(minus(there.result.poses.front(), geometry.result.poses.front()),
                                *geometry.result.covariance);
  return balances ? there : out;
}

/// Again with what shows the initial pose better than the first sample, where something does.
Calibration fit_settled(const Robot& robot, const Log& log, const CalibrateOptions& options) {
  Calibration out = fit_either(prepare(robot, log, options), options);
  if (!options.at_s.empty() || options.formulation == Formulation::paper) return out;
  const CorrectedRun run(robot, log, options.segment);
  const std::optional<SampleRange> start =
      unsettled_start(run.log, run.rows, out, options.detection.window_s);
  return start ? fit_either(prepare(robot, log, options, start), options) : out;
}

}  // namespace

Calibration calibrate(const Robot& robot, const Log& log, const CalibrateOptions& options) {
  CalibrateOptions silent = options;  // of several fits only the last is explained
  silent.solve.explain = false;
  Calibration out = fit_settled(robot, log, silent);
  allow_for_effects(options, out);
  if (options.solve.explain) explain(out.problem, out.result);
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
