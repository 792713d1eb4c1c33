#include "cdprcal/motion/calibrate_in_motion.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "cdprcal/calibration/allow_for_effects.hpp"
#include "cdprcal/calibration/initial_guess.hpp"
#include "cdprcal/calibration/shared_errors.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/effects/corrected_run.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/evidence/scan.hpp"
#include "cdprcal/motion/geometric_readings.hpp"
#include "cdprcal/motion/known_accelerations.hpp"
#include "cdprcal/motion/known_offsets.hpp"
#include "cdprcal/motion/late_readings.hpp"
#include "cdprcal/motion/locked.hpp"
#include "cdprcal/motion/middle_readings.hpp"
#include "cdprcal/motion/smoothed.hpp"
#include "cdprcal/motion/stretches.hpp"
#include "cdprcal/readings/fresh.hpp"
#include "cdprcal/statics/natural_frequencies.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

/// Readings are smoothed over this share of a period of the fastest swing, to both sides; no more
/// than a quarter of a second.
constexpr double kShareOfPeriod = 0.08, kMostHalf_s = 0.25;
/// Stretches are at most so many times as long: two thirds of a period to both sides.
constexpr double kMostStretch = 8.0;
/// So much more jerk than is likely keeps the accelerations of swings within a few thousandths:
/// what a smoother takes off a swing goes with the sixth power of its frequency, and falls as its
/// jerk grows. Fewer would look like an error of the inertia; the poses do not mind.
constexpr double kRestless = 2000.0;
/// Fewer rests than that say too little to begin with.
constexpr std::size_t kFewRests = 2;
/// Solved so often in a round, what is found beside the poses anew in between.
constexpr int kTurns = 3;
/// Late readings and the path that shows how late they are settle in so many rounds more.
constexpr int kLateRounds = 2;
/// The path has settled once a round moves the initial pose by less, in σ; so many rounds more are
/// tried for it.
constexpr double kSettled = 0.1;
constexpr int kSettlingRounds = 4;
/// Of σ: what is late beside the poses is said where it is clear, as many effects are looked at in
/// as many runs; a path is tried with what may be, which shows far better once the path is right.
constexpr double kClear = 4.0, kHint = 2.0;

bool rests(const Calibration& calibration) {
  return calibration.equilibria.size() >= kFewRests && !calibration.result.poses.empty();
}

/// Half of what readings are smoothed over: by the fastest swing with locked winches.
double smoothing_half_s(const Robot& robot, const Pose& pose, const CableVector& tension_N) {
  const PlatformState state = platform_state(robot, pose);
  if (!state.valid || tension_N.size() == 0 || !tension_N.allFinite()) return kMostHalf_s;
  double fastest_hz = 0.0;
  for (const double hz : free_motion_modes(robot, state, tension_N).natural_frequency_hz) {
    if (hz > fastest_hz) fastest_hz = hz;
  }
  return fastest_hz > 0.0 ? std::min(kMostHalf_s, kShareOfPeriod / fastest_hz) : kMostHalf_s;
}

/// A calibration good enough to find the motion with, whatever its fit says of itself.
Calibration as_start(Calibration calibration) {
  CalibrationResult& result = calibration.result;
  if (result.status == CalibrationStatus::converged && result.covariance) return calibration;
  constexpr double kAboutShift = 0.02, kAboutTurn_rad = 0.05;  // of the robot's size
  Vector6 sigma;
  sigma << Vector3::Constant(kAboutShift * robot_size_m(calibration.problem.robot)),
      Vector3::Constant(kAboutTurn_rad);
  result.status = CalibrationStatus::converged;
  result.covariance = Matrix6(sigma.cwiseAbs2().asDiagonal());
  return calibration;
}

/// Where to begin without rests: the platform hangs about where the mean of all readings says.
std::vector<Calibration> swinging_starts(const Robot& robot, const Log& given,
                                         const CorrectedRun& run, const CalibrateOptions& options) {
  constexpr std::size_t kMostGuesses = 4;
  const Calibration prepared = prepare(robot, given, options);
  Measurement mean =
      measurement_mean(run.log, run.rows, PoseKind::static_pose, robot.cable_count());
  const std::vector<Pose> guesses = reference_guesses(robot, mean, prepared.problem.effects);
  mean.kind = PoseKind::kinematic_pose;  // where offsets come from, and no rest
  std::vector<Calibration> out;
  for (const Pose& guess : guesses) {
    if (out.size() == kMostGuesses) break;
    Calibration start = prepared;
    start.problem.measurements = {prepared.problem.measurements.front(), mean};
    start.problem.noise.reset();
    start.result.poses = {guess, guess};
    out.push_back(as_start(std::move(start)));
  }
  return out;
}

bool converged(const InMotion& found) {
  return found.calibration.result.status == CalibrationStatus::converged;
}

/// What each round begins with.
struct MovingRun {
  const InMotionOptions& options;
  const CorrectedRun& corrected;
  PathState directions;
  ActiveEffects effects;  ///< that the robot file lists
  bool by_stretch;        ///< moments are means of stretches, or the middles of parabolas
  /// In any round so far, of whatever start: what one sees better than others. To leave more out
  /// harms little; said is what the last round sees.
  std::vector<Push>& pushed;
};

/// The effects of a problem in motion.
ActiveEffects effects_with(const MovingRun& moving, const Beside& beside) {
  ActiveEffects out = moving.effects;
  out.insert(out.end(), beside.late.begin(), beside.late.end());
  out.push_back({damping(), beside.damping_1_s});
  return out;
}

/// How well it is known what the motion of a sample takes [N, Nm].
Matrix6 inertial_covariance(const Robot& robot, const PlatformState& platform,
                            const SmoothedSample& sample) {
  const Matrix6 mass = mass_matrix(robot, platform);
  return mass * sample.covariance.bottomRightCorner<6, 6>() * mass.transpose();
}

/// Whether some load cells say nothing at a row.
bool is_partly_read(const Log& log, Eigen::Index row) {
  return log.tension_N.cols() == 0 || log.tension_N.row(row).array().isNaN().any();
}

/// The rows of the middle half of a stretch, about which its weight is.
SampleRange rows_around(const Log& log, const SampleRange& run, Eigen::Index row, double half_s) {
  SampleRange out{row, row + 1};
  const auto within = [&](Eigen::Index other) {
    return std::abs(log.time_s[other] - log.time_s[row]) <= 0.5 * half_s;
  };
  while (out.begin > run.begin && within(out.begin - 1)) --out.begin;
  while (out.end < run.end && within(out.end)) ++out.end;
  return out;
}

/// What the twist makes of readings; and those that were read ahead as ones that come late by the
/// first term alone, which is what effects of their rate take them for.
void take_rates(const GeometricReadings& at, const Vector6& twist, const SensorTimes& ahead_s,
                Measurement& m) {
  m.length_rate_m_s = at.model.length_by_twist * twist;
  m.swivel_rate_rad_s = at.model.swivel_by_twist * twist;
  m.attitude_rate_rad_s = at.model.attitude_by_twist * twist;
  m.length_m -= ahead_s[Channel::length] * m.length_rate_m_s;
  m.swivel_rad -= ahead_s[Channel::swivel] * m.swivel_rate_rad_s;
  m.roll_pitch_yaw_rad -= ahead_s[Channel::yaw] * m.attitude_rate_rad_s;
  m.excess_wrench -= ahead_s[Channel::balance] * m.rising_wrench;
}

/// The first sample of a run that begins in motion.
void begin_in_motion(const LateReadings& read, const SmoothedSample& begin, const Robot& robot,
                     Measurement& first) {
  GeometricReadings model;
  if (!evaluate(robot, {}, first, begin.state.pose, model)) return;
  const Measurement ahead =
      measurement_at(read.run.log, read.run.rows.begin, first.kind, robot.cable_count());
  first.length_m = ahead.length_m;
  first.swivel_rad = ahead.swivel_rad;
  first.roll_pitch_yaw_rad = ahead.roll_pitch_yaw_rad;
  take_rates(model, begin.state.twist, read.ahead_s, first);
}

/// The moments of motion beside the rests of a calibration: measurements and guesses are appended;
/// how many.
std::size_t add_moments(const Calibration& start, const MovingRun& moving, const Beside& beside,
                        const LateReadings& read, const std::vector<SmoothedSample>& path,
                        const std::vector<Push>& pushed, CalibrationProblem& problem,
                        std::vector<Pose>& guess) {
  const Robot& robot = problem.robot;
  // A reading that is held is older from row to row: of one time, as the others.
  const CorrectedRun run(read.run, without_holds(read.run.log));
  const Log& log = run.log;
  const std::size_t middle = start.problem.measurements.size() / 2;
  const double half_s = smoothing_half_s(robot, start.result.poses[middle],
                                         start.problem.measurements[middle].tension_N);
  const double begin_s = log.time_s[run.rows.begin];
  const double lasts_s = log.time_s[run.rows.end - 1] - begin_s;
  const Robot changed = with_effects(robot, effects_with(moving, beside));
  std::optional<Stretches> stretches;
  if (moving.by_stretch) {
    stretches.emplace(changed, run, path, known_offsets(start),
                      start.signals[static_cast<std::size_t>(Channel::balance)].sigma, half_s,
                      kMostStretch * half_s);
  }
  const double each_s = 2.0 * (stretches ? stretches->half_s() : half_s);
  const double spacing_s =
      std::max(moving.options.spacing * each_s, lasts_s / moving.options.most_moments);
  std::vector<Matrix6> noise;
  double last_s = begin_s;
  for (Eigen::Index row = run.rows.begin + 1; row < run.rows.end; ++row) {
    const double time_s = log.time_s[row];
    const SmoothedSample& sample = path[static_cast<std::size_t>(row - run.rows.begin)];
    const MotionState& state = sample.state;
    if (time_s - last_s < spacing_s || is_resting(start, time_s, half_s) ||
        !state.pose.position_m.allFinite()) {
      continue;
    }
    // Tensions that nothing reads are found from the balance of their own moment.
    const bool alone = !stretches || is_partly_read(log, row);
    CableVector tension_rate_N_s;
    Matrix6 covariance;
    std::optional<Measurement> about =
        alone ? middle_reading(log, run.rows, row, half_s, robot.cable_count(), tension_rate_N_s)
              : stretches->about(row, covariance);
    if (!about) continue;
    Measurement& m = *about;
    add_path(
        moving.directions, log,
        alone ? SampleRange{row, row + 1} : rows_around(log, run.rows, row, stretches->half_s()),
        begin_s, m);
    GeometricReadings model;
    if (!evaluate(robot, {}, m, state.pose, model)) continue;
    if (alone) {
      m.twist = state.twist;
      m.acceleration = state.acceleration;
      const PlatformState platform = platform_state(robot, state.pose);
      covariance = inertial_covariance(robot, platform, sample);
      m.inertial_sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
      m.rising_wrench = structure_matrix(platform) * tension_rate_N_s;
    }
    take_rates(model, m.twist, read.ahead_s, m);
    m.balance_counts = !is_pushed(pushed, time_s, 0.5 * each_s);
    last_s = time_s;
    problem.measurements.push_back(std::move(m));
    guess.push_back(state.pose);
    noise.push_back(covariance);
  }
  if (moving.options.multiplied) {
    const std::vector<Pose> poses(guess.end() - std::ssize(noise), guess.end());
    const std::span all(problem.measurements);
    shrink_accelerations(robot, poses, noise, 1.0 / moving.options.spacing, all.last(noise.size()));
  }
  return noise.size();
}

/// Of the moments of a calibration in motion, which come last.
double shared_by_moments(const InMotion& found) {
  return moments_a_reading(found.calibration.result.residuals,
                           static_cast<std::size_t>(found.calibration.kinematic_poses));
}

/// What an error of the initial pose grows by where as many moments are worth one: √worth, and less
/// in the directions in which the rests know as much alone. With the information J of rests and I −
/// J of motion, both as counted, the errors' covariance is J + worth (I − J).
Matrix6 widening(const CalibrationResult& together, const Calibration& plain, double worth) {
  constexpr double kNone = 1e-14;  // of the largest variance: where the platform cannot move
  const std::optional<Matrix6>& alone = plain.result.covariance;
  if (!together.covariance) return Matrix6::Identity();
  const SymmetricEigen<Matrix6> own(*together.covariance);
  const auto count = (own.eigenvalues().array() > kNone * own.eigenvalues().maxCoeff()).count();
  const Eigen::VectorXd sigma = own.eigenvalues().tail(count).cwiseSqrt();
  const Eigen::MatrixXd directions = own.eigenvectors().rightCols(count);
  const Eigen::MatrixXd root = directions * sigma.asDiagonal();
  Eigen::MatrixXd of_rests = Eigen::MatrixXd::Zero(count, count);
  if (rests(plain) && alone && plain.result.status == CalibrationStatus::converged) {
    of_rests = root.transpose() * least_norm(Eigen::MatrixXd(*alone), root);
  }
  const SymmetricEigen<Eigen::MatrixXd> eigen(0.5 * (of_rests + of_rests.transpose()));
  const Eigen::VectorXd share = eigen.eigenvalues().cwiseMax(0.0).cwiseMin(1.0);
  const Eigen::VectorXd scale = (worth - (worth - 1.0) * share.array()).sqrt();
  return root * eigen.eigenvectors() * scale.asDiagonal() * eigen.eigenvectors().transpose() *
         sigma.cwiseInverse().asDiagonal() * directions.transpose();
}

/// Of a model that misfits, with and without all effects at their typical size. Errors of motion
/// hang together in ways that no effect has, and take effects' places: neither model is ruled out.
/// The mean of both, and in σ how far they are apart (Hoeting et al. 1999, eqs 1–4).
void average_with(const CalibrationResult& fitted, CalibrationResult& allowed) {
  if (!fitted.covariance || !allowed.covariance) return;
  const Vector6 apart = minus(allowed.poses.front(), fitted.poses.front());
  if (apart.isZero()) return;
  for (std::size_t i = 0; i < allowed.poses.size(); ++i) {
    allowed.poses[i] = plus(fitted.poses[i], 0.5 * minus(allowed.poses[i], fitted.poses[i]));
  }
  allowed.initial_length_m = 0.5 * (allowed.initial_length_m + fitted.initial_length_m);
  const CableVector turned = allowed.initial_swivel_rad - fitted.initial_swivel_rad;
  allowed.initial_swivel_rad = fitted.initial_swivel_rad + 0.5 * turned.unaryExpr(&wrap_angle);
  *allowed.covariance =
      0.5 * (*allowed.covariance + *fitted.covariance) + 0.25 * apart * apart.transpose();
}

/// By how many σ an effect shows, and in the sign that nature has it in.
double clearness(const ActiveEffect& of, const Eigen::VectorXd& sigma) {
  if (of.effect->info().one_sided && !(of.values.minCoeff() > 0.0)) return 0.0;
  return of.values.cwiseQuotient(sigma).cwiseAbs().maxCoeff();
}

/// What is late in a fitted model, where it is so by `clear` of its σ times `wider`. One sensor
/// after the other: late beside the others is also what is early beside one.
bool find_late(DiagnosisModel& model, const ActiveEffects& listed, double clear, double wider) {
  const auto add_best = [&] {
    Candidates others = effects_of(model.robot);
    std::erase_if(others, [&](const auto& effect) {
      const auto is = [&](const auto& of) { return of.effect == effect; };
      return !effect->info().of_lateness || std::ranges::any_of(listed, is) ||
             std::ranges::any_of(model.effects, is);
    });
    ActiveEffect best;
    double most = clear;
    for (const CandidateScore& score : scan(model, others, {.draws = 0})) {
      const double z = clearness({score.effect, score.values}, wider * score.deviation);
      if (z > most) most = z, best = {score.effect, score.values};
    }
    if (best.effect) model.effects.push_back({best.effect, best.values});
    return best.effect != nullptr;
  };
  const auto drop_least = [&] {
    const Eigen::Index values = model.values().size();
    const Eigen::VectorXd sigma = wider * covariance(model).diagonal().tail(values).cwiseSqrt();
    Eigen::Index begin = values;
    std::size_t least = 0;
    double z = clear;
    for (std::size_t k = model.effects.size(); k-- > 1;) {
      const EffectTerm& term = model.effects[k];
      begin -= term.values.size();
      const double own =
          clearness({term.effect, term.values}, sigma.segment(begin, term.values.size()));
      if (own <= z) z = own, least = k;
    }
    if (least > 0) model.effects.erase(model.effects.begin() + static_cast<std::ptrdiff_t>(least));
    return least > 0;
  };
  while (model.effects.size() > 1 && drop_least()) {
    if (!fit_with_noise(model)) return false;
  }
  while (add_best()) {
    if (!fit_with_noise(model)) return false;
    if (drop_least()) return fit_with_noise(model);
  }
  return true;
}

/// What is found beside the poses, by a calibration in motion: all of it at once, the poses free.
Beside found_beside(const InMotion& found, const MovingRun& moving, double clear) {
  DiagnosisModel model = model_of(found.calibration);
  model.runs.front().known = moving.effects;
  model.effects.push_back({damping(), found.beside.damping_1_s});
  for (const ActiveEffect& late : found.beside.late) {
    model.effects.push_back({late.effect, late.values});
  }
  if (!fit_with_noise(model) ||
      !find_late(model, moving.effects, clear, std::sqrt(shared_by_moments(found)))) {
    return found.beside;
  }
  Beside out;
  out.damping_1_s = model.effects.front().values.cwiseMax(0.0);
  for (std::size_t k = 1; k < model.effects.size(); ++k) {
    out.late.push_back({model.effects[k].effect, model.effects[k].values});
  }
  return out;
}

/// The rests of a calibration and the moments of motion between them, solved together.
InMotion with_motion(const Calibration& start, const MovingRun& moving, double clear = kHint,
                     const Beside& beside = {}) {
  const CalibrateOptions& options = moving.options.calibrate;
  const LateReadings read(start, moving.corrected);
  const std::vector<SmoothedSample> path = smoothed(start, read, kRestless);
  InMotion out;
  out.calibration = start;
  out.in_motion = true;
  out.pushes = pushes(start, moving.corrected, path);
  add(out.pushes, moving.pushed);
  out.beside = beside;
  CalibrationProblem& problem = out.calibration.problem;
  problem.measurements.clear();
  std::vector<Pose> guess;
  for (std::size_t i = 0; i < start.problem.measurements.size(); ++i) {
    const Measurement& m = start.problem.measurements[i];
    const bool rest = m.kind == PoseKind::static_pose && is_resting(start, m.time_s, 1e-9);
    if (i > 0 && !rest) continue;
    problem.measurements.push_back(m);
    guess.push_back(start.result.poses[i]);
  }
  Measurement& first = problem.measurements.front();
  if (first.kind == PoseKind::kinematic_pose) {
    begin_in_motion(read, path.front(), problem.robot, first);
  }
  out.calibration.static_poses = static_cast<int>(problem.measurements.size());
  const std::size_t moments =
      add_moments(start, moving, beside, read, path, moving.pushed, problem, guess);
  out.calibration.kinematic_poses = static_cast<int>(moments);
  problem.noise.reset();
  out.calibration.gated = gate_slack(problem, start.signals);
  CalibrationResult& result = out.calibration.result;
  for (int turn = 0; turn < kTurns; ++turn) {
    problem.effects = effects_with(moving, out.beside);
    result = solve(problem, guess, on_the_way(options.solve));
    if (!converged(out) || !std::isfinite(result.residual_rms.wrench_force_N)) break;
    guess = result.poses;
    if (turn + 1 < kTurns) out.beside = found_beside(out, moving, clear);
  }
  refine_in_place(options, out.calibration);
  return out;
}

/// The calibration that the next round begins with.
Calibration next_start(const InMotion& found, const MovingRun& moving, const Beside& beside) {
  Calibration start = as_start(found.calibration);
  start.problem.effects = effects_with(moving, beside);
  return start;
}

/// By how much a round has moved the initial pose; zero where it has settled.
Vector6 moved(const CalibrationResult& before, const CalibrationResult& after) {
  const Vector6 by = minus(after.poses.front(), before.poses.front());
  if (!after.covariance) return Vector6::Zero();
  constexpr double kNothing = 1e-9;  // m, rad: where the platform cannot move
  const Vector6 little = (kSettled * after.covariance->diagonal().cwiseSqrt()).array() + kNothing;
  return (by.cwiseAbs().array() > little.array()).any() ? by : Vector6(Vector6::Zero());
}

/// Whether a round has found readings to be later, or less so, than the one before: by more than a
/// share of it. What noise does to the rates of readings makes delays look shorter, but for those
/// that they are read ahead by.
bool later(const Beside& before, const Beside& after) {
  constexpr double kShare = 0.03;
  if (before.late.size() != after.late.size()) return true;
  for (std::size_t k = 0; k < after.late.size(); ++k) {
    const EffectValues &old = before.late[k].values, &now = after.late[k].values;
    if (before.late[k].effect != after.late[k].effect) return true;
    if ((now - old).norm() > kShare * now.norm()) return true;
  }
  return false;
}

/// Round after round, each with the path of the last, until that has settled. What the first round
/// says, not converged, where none holds what `first` does.
InMotion settled(const InMotion& first, const MovingRun& moving, int round) {
  InMotion found = first;
  bool holds = false, moves = false;
  const auto rounds = [&] {
    return moving.options.rounds + (found.beside.late.empty() ? 0 : kLateRounds);
  };
  const auto goes_on = [&] {
    return round < rounds() || (moves && round < rounds() + kSettlingRounds);
  };
  for (; goes_on() && !found.calibration.result.poses.empty(); ++round) {
    const double clear = round + 1 < rounds() ? kHint : kClear;
    const Beside beside = found_beside(found, moving, clear);
    InMotion next = with_motion(next_start(found, moving, beside), moving, clear, beside);
    if (converged(next) || next.calibration.result.cost < found.calibration.result.cost) {
      next.moved = moved(found.calibration.result, next.calibration.result);
      moves = !next.moved.isZero() || later(found.beside, next.beside);
      found = std::move(next);
      holds = true;
    } else if (clear == kClear) {
      return holds ? found : next;
    } else {
      round = rounds() - 2;  // then what is clear alone
    }
  }
  return found;
}

/// From a calibration without motion, or from what swings hang about where there is none, or what
/// the fit runs away from; nothing where there is neither.
std::optional<InMotion> rests_and_motion(const Calibration& plain, const Log& log,
                                         const MovingRun& moving) {
  if (rests(plain) || plain.result.status == CalibrationStatus::converged) {
    const InMotion first = with_motion(as_start(plain), moving);
    if (rests(plain) || converged(first)) {
      const InMotion found = settled(first, moving, 1);
      if (converged(found)) return found;
      if (rests(plain)) return first;
    }
  }
  std::optional<InMotion> best;
  for (const Calibration& start :
       swinging_starts(plain.problem.robot, log, moving.corrected, moving.options.calibrate)) {
    InMotion next = with_motion(start, moving);
    if (!best || std::pair(!converged(next), next.calibration.result.cost) <
                     std::pair(!converged(*best), best->calibration.result.cost)) {
      best = std::move(next);
    }
  }
  if (best) best = settled(*best, moving, 0);
  return best;
}

/// "sensor_delay delay_s = 0.0137".
std::string in_words(const ActiveEffect& active) {
  const EffectValues values = active.effect->to_reported(active.values);
  std::string out = active.effect->name() + " " + active.effect->info().parameters.front().name;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    out += printed("%s%.3g", i == 0 ? " = " : ", ", values[i]);
  }
  return out;
}

void check_options(const InMotionOptions& options) {
  const CalibrateOptions& asked = options.calibrate;
  if (asked.method != Method::unified || asked.formulation != Formulation::full ||
      noise_source(asked) != NoiseSource::from_data || !asked.at_s.empty() ||
      !asked.guess.empty()) {
    throw InputError(
        "motion: takes the method unified, the full formulation, noise from the data and poses "
        "found by itself; leave the other options out");
  }
  if (options.most_moments < 1 || options.rounds < 1) {
    throw InputError("motion: most_moments and rounds must be at least 1");
  }
  if (!(options.spacing > 0.0)) throw InputError("motion: spacing must be positive");
}

/// By all rows of a log.
InMotion by_all_rows(const Robot& robot, const Log& log, const InMotionOptions& options) {
  // What effects may do widens what a start is sure of until its readings hardly count, and the
  // path behind the accelerations with it: the outcome allows for them, no step before it does.
  CalibrateOptions as_fitted = options.calibrate;
  as_fitted.allow_for_effects = as_fitted.solve.explain = false;
  Calibration plain = calibrate(robot, log, as_fitted);
  const CorrectedRun run = corrected_run(robot, log, options.calibrate);
  // A motion too rough for stretches (cables that snatch, an attitude that comes late) may still
  // balance from moment to moment, with accelerations that are known for no more than they are.
  std::optional<InMotion> found;
  std::vector<Push> pushed;
  InMotionOptions silent = options;  // of several fits only the last is explained
  silent.calibrate.solve.explain = false;
  // However few moments shall count, path and delays are found by all that there are.
  silent.spacing = std::min(options.spacing, InMotionOptions().spacing);
  silent.multiplied = false;
  MovingRun moving{
      silent, run,   path_state(robot, run.log), known_effects(robot, log, options.calibrate),
      true,   pushed};
  for (const bool by_stretch : {true, false}) {
    moving.by_stretch = by_stretch;
    found = rests_and_motion(plain, log, moving);
    if (found && converged(*found)) break;
  }
  if (found && converged(*found) && (options.multiplied || silent.spacing < options.spacing)) {
    silent.spacing = options.spacing;
    silent.multiplied = options.multiplied;
    InMotion fewer =
        with_motion(next_start(*found, moving, found->beside), moving, kClear, found->beside);
    fewer.moved = found->moved;
    if (converged(fewer)) found = std::move(fewer);
  }
  const auto without_motion = [&](const std::string& why) {
    allow_for_effects(options.calibrate, plain);
    if (options.calibrate.solve.explain) explain(plain.problem, plain.result);
    if (!why.empty()) plain.result.reason += "; motion adds nothing: with it, " + why;
    InMotion out;
    out.without = why;
    out.calibration = std::move(plain);
    return out;
  };
  // Where geometry alone has a pose, the motion around it is known, and what does not balance there
  // is of the model; else it may be of the pose.
  const bool searched = options.contradicted && found &&
                        plain.result.status == CalibrationStatus::converged &&
                        found->calibration.result.status == CalibrationStatus::not_converged &&
                        !found->calibration.result.poses.empty();
  if (!found || (!converged(*found) && !searched)) {
    return without_motion(found ? found->calibration.result.reason : "");
  }
  CalibrationResult& result = found->calibration.result;
  const double worth = found->moments_a_reading = shared_by_moments(*found);
  if (!converged(*found)) return *std::move(found);
  if (result.covariance) {
    const Matrix6 widened = widening(result, plain, worth);
    *result.covariance = widened * *result.covariance * widened.transpose() +
                         found->moved * found->moved.transpose();
  }
  const CalibrationResult fitted = result;
  if (!allow_for_effects(options.calibrate, found->calibration, worth)) {
    return without_motion(
        "the model misfits by more than the uncertainty could allow for; diagnose --motion looks "
        "for what it lacks");
  }
  average_with(fitted, result);
  for (const ActiveEffect& active : found->beside.late) {
    result.reason += "; readings come late, which the pose allows for: " + in_words(active) +
                     "; enter it in the robot file, or correct the time stamps";
  }
  if (!found->pushes.empty()) {
    result.reason += "; something pushes the platform at " + in_words(found->pushes) +
                     ": it gains energy while the winches stand still, and no balance counts there";
  }
  found->swings = swings(found->calibration, run, smoothed(found->calibration, run));
  if (options.calibrate.solve.explain) {
    explain(found->calibration.problem, result);
  }
  return *std::move(found);
}

}  // namespace

InMotionOptions for_a_search() {
  InMotionOptions options;
  options.calibrate.allow_for_effects = false;
  options.most_moments = 300;
  options.spacing = 1.0;
  options.multiplied = options.contradicted = true;
  return options;
}

InMotion calibrate_in_motion(const Robot& robot, const Log& log, const InMotionOptions& options) {
  check_options(options);
  InMotion found = by_all_rows(robot, log, options);
  if (found.in_motion || converged(found)) return found;
  // Between two readings of a sensor that few others make up for, the path is too rough to balance.
  if (const std::optional<Log> anew = rows_read_anew(log)) {
    InMotion by_fewer = by_all_rows(robot, *anew, options);
    if (converged(by_fewer) && by_fewer.in_motion) return by_fewer;
  }
  return found;
}

}  // namespace cdprcal
