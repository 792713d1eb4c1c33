#include "cdprcal/calibration/other_minima.hpp"

#include <cmath>
#include <utility>

#include "cdprcal/calibration/allow_for_effects.hpp"
#include "cdprcal/calibration/initial_guess.hpp"
#include "cdprcal/calibration/multi_start.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/estimation/presence.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

constexpr double kFar = 6.0;   // σ: beyond what a fit calls possible
constexpr double kNear = 3.0;  // σ: within what it says of itself

/// Whether any cable pulls up there. A platform above all of its pulleys hangs on none: that mirror
/// image of a pose fits the lengths, and is none.
bool is_held_up(const Robot& robot, const Pose& pose) {
  constexpr double kSlightly = 0.01;
  const PlatformState state = platform_state(robot, pose);
  for (int i = 0; i < state.cable_count; ++i) {
    if (state.cable[static_cast<std::size_t>(i)].direction.z() < -kSlightly) return true;
  }
  return false;
}

/// Takes back the claim of a pose: another, `apart` from it, fits about as well.
void leave_open(const Vector6& apart, Calibration& out) {
  withdraw(out.problem,
           printed("another initial pose fits the readings about as well, %.3g mm and %.3g deg "
                   "away; measure at more varied poses, or with more sensors",
                   1e3 * apart.head<3>().norm(), apart.tail<3>().norm() / kDegree),
           out.result);
}

double sigmas_of(const Vector6& apart, const Matrix6& covariance) {
  return std::sqrt(std::max(0.0, apart.dot(least_norm(covariance, apart))));
}

/// How far another minimum is from one, where it fits about as well and is beyond what the one
/// calls possible. The other fit may have stopped short of its minimum: then it fits better still.
std::optional<Vector6> rivalled(const CalibrationResult& one, const CalibrationResult& other,
                                double far = kFar) {
  if (!one.covariance || other.poses.empty()) return std::nullopt;
  if (!(other.cost - one.cost < kDecisive)) return std::nullopt;
  const Vector6 apart = minus(other.poses.front(), one.poses.front());
  return sigmas_of(apart, *one.covariance) >= far ? std::optional(apart) : std::nullopt;
}

}  // namespace

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

bool is_far(const Vector6& apart, const Matrix6& covariance) {
  return sigmas_of(apart, covariance) >= kFar;
}

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
  const bool hangs = is_held_up(out.problem.robot, out.result.poses.front());
  const auto cannot_be = [&](const CalibrationResult& other) {
    return hangs && !other.poses.empty() && !is_held_up(out.problem.robot, other.poses.front());
  };
  for (const CalibrationResult& other : minima) {
    if (cannot_be(other)) continue;
    if (const auto apart = rivalled(origin, other)) return leave_open(*apart, out);
  }
  // A valley that is one minimum with the noise specified may be several with the one found, which
  // starts at the bottom do not leave: all poses are lifted over its walls together.
  std::vector<std::vector<Pose>> starts;
  for (CalibrationResult& other : minima) starts.push_back(std::move(other.poses));
  const SymmetricEigen<Matrix6> spread(*out.result.covariance);
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
  Matrix6 wider = *out.result.covariance;
  for (const std::vector<Pose>& start : starts) {
    const CalibrationResult again =
        solve_unless_hopeless(out.problem, start, options.solve, out.result.cost);
    out.result.solve_time_s += again.solve_time_s;
    if (cannot_be(again)) continue;
    const auto apart = rivalled(out.result, again, kNear);
    if (!apart) continue;
    if (is_far(*apart, *out.result.covariance)) return leave_open(*apart, out);
    if (sigmas_of(*apart, wider) < kNear) continue;  // counted already
    // Too near to take the claim back and too far for it: as probable as it fits.
    const double worse = std::max(0.0, again.cost - out.result.cost);
    wider += 1.0 / (1.0 + std::exp(worse)) * *apart * apart->transpose();
  }
  out.result.covariance = wider;
}

}  // namespace cdprcal
