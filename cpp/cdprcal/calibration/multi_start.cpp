#include "cdprcal/calibration/multi_start.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cdprcal/calibration/initial_guess.hpp"
#include "cdprcal/estimation/presence.hpp"

namespace cdprcal {
namespace {

/// A better outcome: an accepted minimum before a doubtful one, then the lower cost.
bool better(const CalibrationResult& a, const CalibrationResult& b) {
  const bool a_good = a.status == CalibrationStatus::converged;
  const bool b_good = b.status == CalibrationStatus::converged;
  if (a_good != b_good) return a_good;
  if (std::isfinite(a.cost) != std::isfinite(b.cost)) return std::isfinite(a.cost);
  return a.cost < b.cost;
}

/// A minimum that needs no second look: accepted, and residuals no more than twice the noise.
bool fits(const CalibrationResult& result) {
  constexpr double kPlain = 4.0;  // χ² per degree of freedom; noise of a file is known no better
  const int freedom = std::max(1, result.residual_count - result.parameter_count);
  return result.status == CalibrationStatus::converged && 2.0 * result.cost <= kPlain * freedom;
}

struct Start {
  Pose reference;
  RestGuess rests = RestGuess::estimated;
  bool elsewhere = true;  ///< another ζ0 than the one before: that both agree says something
};

std::vector<Start> starts_of(const CalibrationProblem& problem, int most_starts) {
  std::vector<Start> starts;
  for (const Pose& pose :
       reference_guesses(problem.robot, problem.measurements.front(), problem.effects)) {
    starts.push_back({pose});
  }
  if (problem.statics != StaticsModel::none && !reads_tensions(problem.measurements)) {
    // Rests then hang where their lengths let them, the first of them too.
    const Robot robot = with_effects(problem.robot, problem.effects);
    std::vector<Start> both;
    for (Start start : starts) {
      const std::optional<Pose> hung = hanging_near(robot, start.reference);
      both.push_back({hung.value_or(start.reference), RestGuess::ideal});
      start.elsewhere = hung.has_value();
      both.push_back(start);
    }
    starts = std::move(both);
    most_starts *= 2;
  } else if (problem.statics != StaticsModel::none) {
    starts.front().elsewhere = false;
    starts.insert(starts.begin(), {starts.front().reference, RestGuess::ideal});
  }
  starts.resize(std::min(starts.size(), static_cast<std::size_t>(std::max(1, most_starts))));
  return starts;
}

constexpr int kSpread = 24;     // guesses all over the workspace
constexpr int kFewSteps = 100;  // near a minimum a stage takes ten

bool is_unfinished(const CalibrationResult& result) {
  return result.status == CalibrationStatus::not_converged && result.iterations >= kFewSteps &&
         !result.poses.empty();
}

CalibrationResult solve_briefly(const CalibrationProblem& problem, const std::vector<Pose>& guess,
                                SolveOptions options) {
  options.max_iterations = std::min(kFewSteps, options.max_iterations);
  return solve(problem, guess, options);
}

CalibrationResult finished(const CalibrationProblem& problem, const CalibrationResult& result,
                           const SolveOptions& options) {
  if (!is_unfinished(result)) return result;
  CalibrationResult out = solve(problem, result.poses, options);
  out.iterations += result.iterations;
  out.solve_time_s += result.solve_time_s;
  return out;
}

CalibrationResult solve_from(const CalibrationProblem& problem, const Start& start,
                             const SolveOptions& options) {
  std::vector<Pose> guesses = measurement_guesses(problem.robot, problem.measurements,
                                                  start.reference, problem.effects, start.rests);
  double solve_time_s = 0.0;
  if (const auto upright = kept_upright(problem, start.reference)) {
    CalibrationResult kept = solve_briefly(*upright, guesses, options);
    solve_time_s = kept.solve_time_s;
    if (kept.poses.size() == guesses.size()) guesses = std::move(kept.poses);
  }
  CalibrationResult result = solve_briefly(problem, guesses, options);
  result.solve_time_s += solve_time_s;
  return result;
}

/// The best of what starts end in, and of an end that is known.
CalibrationResult best_from(const CalibrationProblem& problem, const std::vector<Start>& starts,
                            const SolveOptions& options, std::optional<CalibrationResult> best,
                            std::vector<CalibrationResult>* ends = nullptr) {
  double solve_time_s = best ? best->solve_time_s : 0.0;
  bool is_new = false;
  for (const Start& start : starts) {
    CalibrationResult result = solve_from(problem, start, options);
    solve_time_s += result.solve_time_s;
    if (ends) ends->push_back(result);
    const bool again = best && start.elsewhere && same_minimum(result, *best);
    if (!best || better(result, *best)) {
      best = std::move(result);
      is_new = true;
    }
    // A good minimum ends the search, and so does a bad one that two starts agree on; too few
    // readings would fail the same way from anywhere.
    if (again || fits(*best)) break;
    if (best->poses.empty() && best->iterations == 0) break;
  }
  solve_time_s -= best->solve_time_s;
  if (is_new) best = finished(problem, *best, options);
  best->solve_time_s += solve_time_s;
  return *std::move(best);
}

}  // namespace

bool same_minimum(const CalibrationResult& a, const CalibrationResult& b) {
  if (a.poses.empty() || b.poses.empty()) return false;
  constexpr double kNear = 1e-3;  // m, rad: far below the distance between minima
  return std::abs(a.cost - b.cost) < 1e-3 * std::max(a.cost, b.cost) &&
         minus(a.poses.front(), b.poses.front()).norm() < kNear;
}

CalibrationResult solve_unless_hopeless(const CalibrationProblem& problem,
                                        const std::vector<Pose>& guess, const SolveOptions& options,
                                        double cost) {
  const CalibrationResult brief = solve_briefly(problem, guess, options);
  return brief.cost < cost + kDecisive ? finished(problem, brief, options) : brief;
}

CalibrationResult solve_from_starts(const CalibrationProblem& problem,
                                    const std::optional<Pose>& initial, int most_starts,
                                    const SolveOptions& options,
                                    std::vector<CalibrationResult>* ends) {
  return best_from(problem,
                   initial ? std::vector<Start>{{*initial}} : starts_of(problem, most_starts),
                   options, std::nullopt, ends);
}

CalibrationResult solve_from_anywhere(const CalibrationProblem& problem,
                                      const SolveOptions& options, CalibrationResult nowhere) {
  std::vector<Start> starts;
  for (const Pose& guess : spread_guesses(problem.robot, problem.measurements.front(), kSpread)) {
    starts.push_back({.reference = guess, .elsewhere = false});
  }
  return best_from(problem, starts, options, std::move(nowhere));
}

std::vector<CalibrationResult> minima_from_starts(const CalibrationProblem& problem,
                                                  int most_starts, const SolveOptions& options,
                                                  std::vector<CalibrationResult> ends) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const CalibrationResult& end : ends) lowest = std::min(lowest, end.cost);
  const std::vector<Start> starts = starts_of(problem, most_starts);
  double solve_time_s = 0.0;
  for (std::size_t i = ends.size(); i < starts.size(); ++i) {
    ends.push_back(solve_from(problem, starts[i], options));
    solve_time_s += ends.back().solve_time_s;
    lowest = std::min(lowest, ends.back().cost);
  }
  std::vector<CalibrationResult> out;
  for (CalibrationResult& end : ends) {
    if (end.cost < lowest + kDecisive) end = finished(problem, end, options);
    const auto known = [&](const CalibrationResult& other) { return same_minimum(end, other); };
    if (!std::isfinite(end.cost) || std::any_of(out.begin(), out.end(), known)) continue;
    out.push_back(std::move(end));
  }
  std::stable_sort(
      out.begin(), out.end(),
      [](const CalibrationResult& a, const CalibrationResult& b) { return a.cost < b.cost; });
  if (!out.empty()) out.front().solve_time_s = solve_time_s;
  return out;
}

}  // namespace cdprcal
