#include <algorithm>
#include <chrono>

#include "cdprcal/error.hpp"
#include "cdprcal/estimation/assembly.hpp"
#include "cdprcal/estimation/balance_roots.hpp"
#include "cdprcal/estimation/curvature.hpp"
#include "cdprcal/estimation/least_observed.hpp"
#include "cdprcal/estimation/mean_square.hpp"
#include "cdprcal/estimation/minimise_ceres.hpp"
#include "cdprcal/estimation/presence.hpp"
#include "cdprcal/estimation/problem.hpp"
#include "cdprcal/statistics.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

/// Residuals this many σ, root mean square over a whole channel, contradict the model whatever
/// their number: the pose that fits them is not to be trusted.
constexpr double kContradiction = 3.0;
/// A rotation known to no better than this [rad] says nothing: the linearisation behind the
/// covariance ends there too.
constexpr double kUselessRotation = 1.0;

MinimiserOptions minimiser_options(const SolveOptions& options, bool last_stage) {
  // A stage before the last only has to come near.
  return {.max_iterations = options.max_iterations,
          .function_tolerance = last_stage ? options.function_tolerance : 1e-3,
          .parameter_tolerance = last_stage ? options.parameter_tolerance : 1e-6,
          .gradient_tolerance = options.gradient_tolerance};
}

void check(const SolveOptions& options) {
  const auto is_bad = [](double v) { return !std::isfinite(v) || v <= 0.0; };
  if (options.graduation.empty() || options.graduation.back() != 1.0 ||
      std::ranges::any_of(options.graduation, is_bad)) {
    throw InputError("graduation: must be positive numbers, the last of them 1; give such");
  }
  if (options.max_iterations < 0) {
    throw InputError("max_iterations: is " + std::to_string(options.max_iterations) +
                     "; give 0 or more");
  }
  const auto require_not_negative = [](double value, const char* field) {
    if (std::isfinite(value) && value >= 0.0) return;
    throw InputError(std::string(field) + ": must be finite and not negative; give such a number");
  };
  require_not_negative(options.function_tolerance, "function_tolerance");
  require_not_negative(options.parameter_tolerance, "parameter_tolerance");
  require_not_negative(options.gradient_tolerance, "gradient_tolerance");
  require_not_negative(options.settled, "settled");
}

/// Root mean square of the balance in units of what the robot file specifies for the load cells,
/// whatever the weights; what the model itself is wrong by is allowed for as it was found.
double specified_statics_rms(const CalibrationProblem& problem, Assembly& assembly,
                             const std::vector<PoseResidual>& residuals) {
  const WeighedPoses& at = assembly.poses();
  const SensorSigma& specified = problem.robot.sigma;
  BalanceSigma sigma{CableVector::Constant(problem.robot.cable_count(), specified.tension_N), {}};
  double force_N = specified.wrench_force_N, moment_Nm = specified.wrench_moment_Nm;
  if (problem.noise) {
    force_N = std::max(force_N, problem.noise->wrench_force_N);
    moment_Nm = std::max(moment_Nm, problem.noise->wrench_moment_Nm);
  }
  std::vector<Pose> poses;
  std::vector<BalanceSigma> sigmas;
  std::vector<Vector6> balances;
  MeanSquare whitened;
  const double found_N = problem.noise ? problem.noise->wrench_force_N : force_N;
  for (std::size_t i = 0; i < at.size(); ++i) {
    if (at.statics_of(i) != StaticsModel::wrench) continue;
    if (const PartialBalance* const partial = assembly.partial_balance(i)) {
      // Fewer equations, which the model's own error alone, or almost alone, makes uncertain.
      const Vector6 own = found_N / force_N * (partial->whitening * residuals[i].wrench);
      for (int row = 6 - balance_equations(problem.robot, problem.measurements[i]); row < 6; ++row)
        whitened.add(own[row]);
      continue;
    }
    poses.push_back(at.pose(i));
    sigma.wrench = wrench_sigma(force_N, moment_Nm, problem.measurements[i].inertial_sigma);
    sigmas.push_back(sigma);
    balances.push_back(residuals[i].wrench);
  }
  const std::vector<Matrix6> roots = inverse_balance_roots(at.robot(), poses, sigmas);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    for (const double v : Vector6(roots[i] * balances[i])) whitened.add(v);
  }
  return whitened.rms();
}

/// Runs the graduated stages; returns whether the last one converged.
bool run_stages(const CalibrationProblem& problem, const SolveOptions& options, Assembly& assembly,
                CalibrationResult& result) {
  MinimiserSummary summary;
  if (options.minimiser == MinimiserKind::ceres) assembly.hold_weights();
  const auto stage = [&](double graduation, bool last) {
    assembly.poses().update_wrench_weights(graduation);
    summary = options.minimiser == MinimiserKind::ceres
                  ? minimise_with_ceres(assembly, minimiser_options(options, last))
                  : assembly.minimise(minimiser_options(options, last));
    result.iterations += summary.evaluations;
    return summary.usable;
  };
  bool usable = true;
  for (std::size_t i = 0; usable && i + 1 < options.graduation.size(); ++i) {
    // A stage is for residuals of about its own size; a start that is nearer needs no weaker one.
    assembly.poses().update_wrench_weights(1.0);
    if (options.graduation[i] > assembly.statics_rms()) continue;
    usable = stage(options.graduation[i], false);
  }
  Pose before = assembly.poses().pose(0);
  usable = usable && stage(1.0, true);
  if (problem.statics == StaticsModel::wrench) {
    // The weights of the balance depend on the poses: repeat until they agree with each other.
    constexpr int kMostRefreshes = 20;
    for (int i = 0; i < kMostRefreshes; ++i) {
      if (!usable || !summary.converged) break;
      if (minus(assembly.poses().pose(0), before).norm() < options.settled) break;
      before = assembly.poses().pose(0);
      usable = stage(1.0, true);
    }
  }
  result.cost = summary.cost;
  const bool converged = usable && summary.converged;
  if (!converged) {
    result.reason =
        usable ? "stopped without reaching a minimum; measure at more varied poses, or with more "
                 "sensors"
               : "the solver failed: a pose left the region where the cables' "
                 "geometry is defined, or the start was outside it";
  }
  return converged;
}

/// The channels whose residuals contradict their σ, in words; empty when none does.
std::string contradictions(const CalibrationProblem& problem, Assembly& assembly,
                           const CalibrationResult& result) {
  const ResidualRms& rms = result.residual_rms;
  const SensorSigma& sigma = problem.robot.sigma;
  std::string text;
  const auto judge = [&](double value, double limit, double scale, const std::string& pattern) {
    if (std::isfinite(value) && value > kContradiction * limit) {
      add_item(text, printed(pattern.c_str(), value * scale, limit * scale), "; ");
    }
  };
  for_each_channel(
      [&](const ChannelRow& row, double value) {
        const Quantity shown = quantity_of(row.of());
        const std::string in_unit = std::string(" %.3g ") + shown.unit;
        judge(value, sigma.*row.of().sigma, shown.scale,
              row.plural + (" off by" + in_unit) + " rms against sigma" + in_unit);
      },
      rms);
  if (const auto push = assembly.hardest_push()) {
    add_item(
        text,
        printed("at the rest at %.2f s cable %d, whose tension is not read, would have to push "
                "with %.3g N and more",
                problem.measurements[push->measurement].time_s, push->cable + 1, push->force_N),
        "; ");
  }
  if (problem.statics == StaticsModel::wrench) {
    judge(specified_statics_rms(problem, assembly, result.residuals), 1.0, 1.0,
          "static balance off by %.3g sigma rms (expected %.3g)");
    if (problem.noise) {  // which is no less than the robot file's where no balance tells it
      judge(problem.noise->wrench_force_N, std::max(sigma.tension_N, sigma.wrench_force_N), 1.0,
            "static balance off by %.3g N beyond what the load cells explain (sigma %.3g N)");
    }
  }
  return text;
}

/// The largest change of a cable's length or swivel since the reference, over its noise.
double largest_motion(const CalibrationProblem& problem, const WeighedPoses& at) {
  const Measurement& first = problem.measurements.front();
  double largest = 0.0;
  const auto look = [&](const CableVector& now, const CableVector& then, double weight, bool wrap) {
    for (Eigen::Index c = 0; c < std::min(now.size(), then.size()); ++c) {
      double change = now[c] - then[c];
      if (wrap && std::isfinite(change)) change = wrap_angle(change);
      if (std::isfinite(change)) largest = std::max(largest, weight * std::abs(change));
    }
  };
  for (std::size_t i = 1; i < problem.measurements.size(); ++i) {
    const Measurement& m = problem.measurements[i];
    look(m.length_m, first.length_m, at.weight(i, Channel::length), false);
    look(m.swivel_rad, first.swivel_rad, at.weight(i, Channel::swivel), true);
  }
  return largest;
}

constexpr const char* kCheckSensors =
    "; check signs, scales and order of the sensors in the configuration, and whether they are as "
    "good as its sigma say";

void judge(const CalibrationProblem& problem, Assembly& assembly, bool converged, bool explain,
           CalibrationResult& result) {
  const std::string doubts = contradictions(problem, assembly, result);
  if (!converged) {
    if (!doubts.empty()) {
      result.reason +=
          "; where it stopped the model contradicts the readings: " + doubts + kCheckSensors;
    }
    return;
  }
  // Without statics all there is to see is motion. Where there was none, noise looks like it, and
  // the linearised covariance believes it.
  constexpr double kMotion = 6.0;  // σ: what noise alone does not do in thousands of readings
  bool relative_only = true;
  for (std::size_t c = kPaperChannels; c < kChannels; ++c) {
    const bool length = kChannelTable[c].of().is_length();
    relative_only = relative_only && !(length && is_read(problem, static_cast<Channel>(c)));
  }
  if (problem.statics == StaticsModel::none && relative_only &&
      largest_motion(problem, assembly.poses()) < kMotion) {
    result.status = CalibrationStatus::unobservable;
    result.reason =
        "the platform hardly moved: no length or swivel changed beyond its noise; measure at more "
        "varied poses";
    return;
  }
  const auto least = [&] {
    LeastObserved out = least_observed(problem, assembly);
    result.least_observed = out.sentence;
    return out.information;
  };
  const ReferenceInformation information = explain ? least() : assembly.reference_information();
  if (!information.covariance) {
    if (!explain) least();  // what cannot be seen is to be said
    result.status = CalibrationStatus::unobservable;
    result.reason = "the readings leave at least one direction of the initial pose undetermined (" +
                    result.least_observed +
                    "); measure at more or more varied poses, or with more sensors";
    return;
  }
  const Vector6 deviation = information.covariance->diagonal().cwiseSqrt();
  // A position known to no better than the size of the robot says nothing.
  if (deviation.head<3>().maxCoeff() > robot_size_m(problem.robot) ||
      deviation.tail<3>().maxCoeff() > kUselessRotation) {
    if (!explain) least();
    result.status = CalibrationStatus::unobservable;
    result.reason = printed(
        "the readings hardly determine the initial pose: standard deviations "
        "reach %.3g m and %.3g deg; measure at more or more varied poses",
        deviation.head<3>().maxCoeff(), deviation.tail<3>().maxCoeff() / kDegree);
    return;
  }
  result.covariance = information.covariance;
  if (!doubts.empty()) {
    result.status = CalibrationStatus::not_converged;
    result.reason =
        "a minimum was found, but it contradicts the readings, so it is not the pose: " + doubts +
        kCheckSensors;
    return;
  }
  result.status = CalibrationStatus::converged;
  result.reason = "minimum found; residuals are within what the sensors' sigma allow";
}

}  // namespace

CalibrationResult solve(const CalibrationProblem& given, const std::vector<Pose>& guess,
                        const SolveOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  std::optional<CalibrationProblem> filled;
  const CalibrationProblem& problem = completed(given, guess, filled);
  check(options);
  Assembly assembly(problem, guess);
  CalibrationResult result;
  result.residual_count = assembly.residual_count();
  result.parameter_count = assembly.parameter_count();
  if (!assembly.may_be_determined()) {
    result.status = CalibrationStatus::unobservable;
    result.reason = "fewer readings than unknowns: " + std::to_string(result.residual_count) +
                    " equations for " + std::to_string(result.parameter_count) +
                    " unknowns; measure at more poses or with more sensors";
    return result;
  }
  const bool converged = run_stages(problem, options, assembly, result);
  result.solve_time_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  if (!std::isfinite(result.cost)) result.cost = assembly.cost();
  result.poses.reserve(assembly.poses().size());
  for (std::size_t i = 0; i < assembly.poses().size(); ++i) {
    result.poses.push_back(assembly.poses().pose(i));
  }
  const PlatformState initial = platform_state(assembly.poses().robot(), result.poses[0]);
  if (!initial.valid || !std::isfinite(result.cost)) {
    if (result.reason.empty()) result.reason = describe_invalid(initial);
    if (result.reason.empty()) {
      result.reason = "the residuals are beyond double precision: a reading is absurdly large";
    }
    result.poses.clear();
    return result;
  }
  result.initial_length_m = initial.length_m();
  result.initial_swivel_rad = initial.swivel_rad();
  result.residuals = assembly.residuals();
  result.reference_errors = assembly.reference_errors();
  result.residual_rms = residual_rms(result.residuals, problem.reference_attitude);
  result.chi_square_p_value =
      chi_square_survival(2.0 * result.cost, result.residual_count - result.parameter_count);
  judge(problem, assembly, converged, options.explain, result);
  // Only weak problems reach that far; what the paper's formulation claims is the paper's.
  constexpr double kMostChange = 4.0;  // of a variance: twice the standard deviation
  if (result.status == CalibrationStatus::converged && problem.reference_noise &&
      result.standard_deviation().tail<3>().maxCoeff() > kFarRotation_rad) {
    if (const double change = variance_ratio_nearby(problem, result); change > kMostChange) {
      withdraw(problem,
               printed("a minimum was found, but how well it is known cannot be said: two standard "
                       "deviations away variances are %.3g times as large or small (at most %.3g); "
                       "measure at more varied poses, or with more sensors",
                       std::min(change, 1e6), kMostChange),
               result);
      result.curved = true;
    }
  }
  return result;
}

void look_around(const CalibrationProblem& given, CalibrationResult& result) {
  constexpr double kMostWidening = 2.0;  // a standard deviation that says half as much is none
  if (result.status != CalibrationStatus::converged || !given.reference_noise) return;
  std::optional<CalibrationProblem> filled;
  const CalibrationProblem& problem = completed(given, result.poses, filled);
  const Nearby there = nearby(problem, result);
  if (!(there.widening > 1.0)) return;
  if (there.widening <= kMostWidening) {
    result.covariance = there.covariance;
    return;
  }
  withdraw(problem,
           printed("a minimum was found, but how well it is known cannot be said: away from it the "
                   "readings allow %.3g times as much rotation as at it (at most %.3g); measure at "
                   "more varied poses, or with more sensors",
                   std::min(there.widening, 1e3), kMostWidening),
           result);
}

void withdraw(const CalibrationProblem& problem, std::string reason, CalibrationResult& result) {
  explain(problem, result);  // which takes the covariance
  result.status = CalibrationStatus::unobservable;
  result.reason = std::move(reason);
  result.covariance.reset();
}

void explain(const CalibrationProblem& given, CalibrationResult& result) {
  if (!result.covariance || !result.least_observed.empty()) return;
  std::optional<CalibrationProblem> filled;
  const CalibrationProblem& problem = completed(given, result.poses, filled);
  Assembly assembly(problem, result.poses);
  assembly.set_reference_errors(result.reference_errors);
  assembly.poses().update_wrench_weights(1.0);
  result.least_observed = least_observed(problem, assembly, &*result.covariance).sentence;
}

const char* to_string(CalibrationStatus status) {
  switch (status) {
    case CalibrationStatus::converged:
      return "converged";
    case CalibrationStatus::not_converged:
      return "not_converged";
    case CalibrationStatus::unobservable:
      return "unobservable";
  }
  return "unknown";
}

}  // namespace cdprcal
