#include "cdprcal/calibration/other_minima.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "cdprcal/calibration/allow_for_effects.hpp"
#include "cdprcal/calibration/initial_guess.hpp"
#include "cdprcal/calibration/multi_start.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/estimation/presence.hpp"
#include "cdprcal/estimation/unread_tensions.hpp"
#include "cdprcal/kinematics/motion.hpp"
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

/// Whether a fit above all pulleys cannot be what hangs below them.
bool cannot_be(const Calibration& found, const CalibrationResult& other) {
  const Robot& robot = found.problem.robot;
  return is_held_up(robot, found.result.poses.front()) && !other.poses.empty() &&
         !is_held_up(robot, other.poses.front());
}

/// −log of how probable the readings are at a minimum, with the noise found there; but for what all
/// minima of a log share. A reading that was left out is an outlier, which few are.
double nats_of(const Calibration& c) {
  constexpr double kLeftOut = 18.0;
  const NoiseModel& noise = *c.problem.noise;
  const NoiseModel specified = specified_noise(c.problem.robot.sigma);
  double out = c.result.cost;
  for (const GatedReading& reading : c.gated) {
    if (reading.reason == GatedReading::Reason::outlier) out += kLeftOut;
  }
  for (const Measurement& m : c.problem.measurements) {
    for (std::size_t i = 0; i < kChannels; ++i) {
      const auto channel = static_cast<Channel>(i);
      if (channel == Channel::balance) continue;
      const auto read = readings_of(m, channel).array().isFinite().count();
      if (read == 0) continue;
      out += static_cast<double>(read) *
             std::log(noise[channel].sigma(m) / specified[channel].sigma(1));
    }
    if (m.in_balance()) {
      out += balance_equations(c.problem.robot, m) *
             std::log(noise.wrench_force_N / specified.wrench_force_N);
    }
  }
  return out;
}

/// Whether the noise that is found may tell minima apart: with rests, whose means are far better
/// than the specified noise. Of moments in motion alone the right one may be none of the minima
/// found.
bool noise_tells(const CalibrateOptions& options, const Calibration& c) {
  return noise_source(options) == NoiseSource::from_data && c.static_poses >= kSeveral;
}

/// A prepared calibration at a minimum, with the noise found there.
Calibration refined_at(const CalibrateOptions& options, const Calibration& prepared,
                       CalibrationResult minimum) {
  Calibration out = prepared;
  out.result = std::move(minimum);
  refine_in_place(options, out);
  return out;
}

/// A noise specified beyond the true one accepts many minima; by the noise that readings show about
/// each, one of them may be far likelier than all others: it takes the place of `out`. False where
/// none is.
bool takes_likeliest(const CalibrateOptions& options, const Calibration& prepared,
                     const std::vector<CalibrationResult>& minima, Calibration& out) {
  constexpr std::size_t kMost = 8;  // that are refined
  if (!noise_tells(options, out) || !out.problem.noise ||
      out.result.status != CalibrationStatus::converged) {
    return false;
  }
  const double lowest = minima.front().cost;
  const auto possible = [&](const CalibrationResult& m) { return m.cost < lowest + kDecisive; };
  if (static_cast<std::size_t>(std::ranges::count_if(minima, possible)) > kMost) return false;
  Calibration best = out;
  double least = nats_of(out), next = std::numeric_limits<double>::infinity();
  for (const CalibrationResult& minimum : minima) {
    if (!possible(minimum) || cannot_be(out, minimum)) continue;
    Calibration other = refined_at(options, prepared, minimum);
    best.result.solve_time_s += other.result.solve_time_s;
    if (other.result.status == CalibrationStatus::not_converged) continue;
    if (other.result.status != CalibrationStatus::converged || !other.problem.noise) return false;
    if (same_minimum(other.result, best.result)) continue;
    const double nats = nats_of(other);
    next = std::min(next, std::max(nats, least));
    if (nats >= least) continue;
    least = nats;
    other.result.solve_time_s = best.result.solve_time_s;
    best = std::move(other);
  }
  if (!(next - least > kDecisive)) return false;
  out = std::move(best);
  return true;
}

/// How much less probable the readings are at another minimum than at one [nats]; 0 where noise
/// that was specified cannot tell.
double less_likely(const CalibrateOptions& options, const Calibration& other,
                   const Calibration& one) {
  if (!noise_tells(options, one) || !one.problem.noise) return 0.0;
  if (other.result.status != CalibrationStatus::converged || !other.problem.noise) return 0.0;
  return nats_of(other) - nats_of(one);
}

/// Where a fit may end in another minimum with the noise found: in those of the specified noise,
/// and beside it.
std::vector<std::vector<Pose>> starts_around(const std::vector<CalibrationResult>& minima,
                                             const Calibration& out) {
  std::vector<std::vector<Pose>> starts;
  for (const CalibrationResult& other : minima) starts.push_back(other.poses);
  // A valley that is one minimum with the noise specified may be several with the one found, which
  // starts at the bottom do not leave: all poses are lifted over its walls together.
  const SymmetricEigen<Matrix6> spread(*out.result.covariance);
  const Vector6 least = kFar * std::sqrt(spread.eigenvalues()[5]) * spread.eigenvectors().col(5);
  for (const Vector6& move : {least, Vector6(-least)}) {
    std::vector<Pose>& start = starts.emplace_back();
    for (const Pose& pose : out.result.poses) start.push_back(plus(pose, move));
  }
  // Nor do they where lengths alone show the attitude: valleys lie a turn of the platform apart.
  const Pose& found = out.result.poses.front();
  if (!kept_upright(out.problem, found)) return starts;
  for (const double turn_deg : {15.0, -15.0, 30.0, -30.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      Vector6 turn = Vector6::Zero();
      turn[3 + axis] = turn_deg * kDegree;
      starts.push_back(measurement_guesses(out.problem.robot, out.problem.measurements,
                                           on_motion(out.problem.robot, plus(found, turn)),
                                           out.problem.effects));
    }
  }
  return starts;
}

/// Looks for minima with the noise found that fit about as well. Near ones widen the covariance;
/// for a far one the claim is taken back, unless one of the two is far likelier with the noise that
/// is found there. True: that is the other, which took the place of `out`.
bool finds_likelier(const CalibrateOptions& options, const Calibration& prepared,
                    const std::vector<CalibrationResult>& minima, Calibration& out) {
  Matrix6 wider = *out.result.covariance;
  for (const std::vector<Pose>& start : starts_around(minima, out)) {
    const CalibrationResult again =
        solve_unless_hopeless(out.problem, start, options.solve, out.result.cost);
    out.result.solve_time_s += again.solve_time_s;
    if (cannot_be(out, again)) continue;
    const auto apart = rivalled(out.result, again, kNear);
    if (!apart) continue;
    if (is_far(*apart, *out.result.covariance)) {
      Calibration other =
          refined_at(options, prepared, solve(prepared.problem, again.poses, options.solve));
      const double nats = less_likely(options, other, out);
      if (nats > kDecisive) continue;
      if (nats > -kDecisive) {
        leave_open(*apart, out);
        return false;
      }
      other.result.solve_time_s += out.result.solve_time_s;
      out = std::move(other);
      return true;
    }
    if (sigmas_of(*apart, wider) < kNear) continue;  // counted already
    // Too near to take the claim back and too far for it: as probable as it fits.
    const double worse = std::max(0.0, again.cost - out.result.cost);
    wider += 1.0 / (1.0 + std::exp(worse)) * *apart * apart->transpose();
  }
  out.result.covariance = wider;
  return false;
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
  const std::vector<CalibrationResult> minima =
      minima_from_starts(prepared.problem, options.most_starts, options.solve, std::move(ends));
  if (minima.empty()) return;
  out.result.solve_time_s += minima.front().solve_time_s;
  const bool told = takes_likeliest(options, prepared, minima, out);
  const bool elsewhere =
      !told && !same_minimum(first, minima.front()) && minima.front().cost < first.cost;
  const CalibrationResult& origin = elsewhere ? minima.front() : first;  // with the noise specified
  if (elsewhere) {
    CalibrationResult there = origin;
    there.solve_time_s = out.result.solve_time_s;
    out = refined_at(options, prepared, std::move(there));
  }
  if (out.result.status != CalibrationStatus::converged) return;
  for (const CalibrationResult& other : minima) {
    if (told || cannot_be(out, other)) continue;
    if (const auto apart = rivalled(origin, other)) return leave_open(*apart, out);
  }
  constexpr int kMoves = 3;  // each to one that is a thousand times as likely
  Pose before = out.result.poses.front();
  for (int move = 0; move < kMoves; ++move) {
    if (!finds_likelier(options, prepared, minima, out)) return;
    if (move + 1 < kMoves) before = out.result.poses.front();
  }
  leave_open(minus(before, out.result.poses.front()), out);
}

}  // namespace cdprcal
