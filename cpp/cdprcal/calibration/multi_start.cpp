#include "cdprcal/calibration/multi_start.hpp"

#include <algorithm>
#include <cmath>

#include "cdprcal/calibration/initial_guess.hpp"

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

/// Whether two starts ended in one place.
bool same_minimum(const CalibrationResult& a, const CalibrationResult& b) {
  if (a.poses.empty() || b.poses.empty()) return false;
  constexpr double kNear = 1e-3;  // m, rad: far below the distance between minima
  return std::abs(a.cost - b.cost) < 1e-3 * std::max(a.cost, b.cost) &&
         minus(a.poses.front(), b.poses.front()).norm() < kNear;
}

}  // namespace

CalibrationResult solve_from_starts(const CalibrationProblem& problem,
                                    const std::optional<Pose>& initial, int most_starts,
                                    const SolveOptions& options) {
  const Robot& robot = problem.robot;
  CalibrationResult best;
  struct Start {
    Pose reference;
    RestGuess rests = RestGuess::estimated;
    bool elsewhere = true;  ///< another ζ0 than the one before
  };
  std::vector<Start> starts;
  if (!initial) {
    for (const Pose& pose :
         reference_guesses(robot, problem.measurements.front(), problem.effects)) {
      starts.push_back({pose});
    }
    if (problem.statics != StaticsModel::none) {
      starts.front().elsewhere = false;
      starts.insert(starts.begin(), {starts.front().reference, RestGuess::ideal});
    }
  } else {
    starts.push_back({*initial});
  }
  double solve_time_s = 0.0;
  bool first = true;
  int tried = 0;
  for (const Start& start : starts) {
    if (tried++ >= std::max(1, most_starts)) break;
    CalibrationResult result =
        solve(problem,
              measurement_guesses(robot, problem.measurements, start.reference, problem.effects,
                                  start.rests),
              options);
    solve_time_s += result.solve_time_s;
    const bool again = !first && start.elsewhere && same_minimum(result, best);
    if (first || better(result, best)) best = std::move(result);
    first = false;
    // A good minimum ends the search, and so does a bad one that two starts agree on; too few
    // readings would fail the same way from anywhere.
    if (again || best.status == CalibrationStatus::converged) break;
    if (best.residual_count < best.parameter_count) break;
  }
  best.solve_time_s = solve_time_s;
  return best;
}

}  // namespace cdprcal
