#include "cdprcal/calibration/online.hpp"

#include <cmath>

#include "cdprcal/calibration/allow_for_effects.hpp"
#include "cdprcal/calibration/initial_guess.hpp"
#include "cdprcal/calibration/multi_start.hpp"
#include "cdprcal/calibration/shared_errors.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

/// The noise is taken anew when there are this many times more poses than when it last was.
constexpr double kNoiseRenewal = 1.1;

}  // namespace

OnlineCalibration::OnlineCalibration(const Robot& robot, const CalibrateOptions& options)
    : robot_(robot), options_(options), explain_(options.solve.explain) {
  // A live estimate may be off by a little of its standard deviation: millimetres, not nanometres.
  options_.solve = loosened(options.solve, 1e-6, 1e-4);
  options_.solve.explain = false;  // said at the end of an update
  if (!options.at_s.empty() || options.segment != -1 || !options.guess.empty()) {
    throw InputError(
        "online calibration: at_s, segment and guess belong to finished logs; leave them out");
  }
}

const Calibration& OnlineCalibration::add(const Log& since_last) {
  if (since_last.sample_count() == 0)
    throw InputError("online calibration: no samples to add; give at least one");
  if (!(since_last.time_s[0] > last_s_)) {
    throw InputError(
        "online calibration: the samples begin before the last ones end; add them in order, each once");
  }
  Calibration stretch = prepare(robot_, since_last, options_);
  last_s_ = since_last.time_s[since_last.sample_count() - 1];
  append(since_last, std::move(stretch));
  update();
  return calibration_;
}

void OnlineCalibration::append(const Log& since_last, Calibration&& stretch) {
  const auto samples = static_cast<double>(since_last.sample_count());
  auto& measurements = all_.problem.measurements;
  if (measurements.empty()) {
    all_ = std::move(stretch);
    samples_ = samples;
    return;
  }
  const double run_start_s = measurements.front().time_s;
  const double offset_s = since_last.time_s[0] - run_start_s;
  auto& more = stretch.problem.measurements;
  // A reference in motion is there because a problem needs one; this one has another.
  if (more.front().kind == PoseKind::kinematic_pose) more.erase(more.begin());
  for (Measurement& m : more) m.run_time_s += offset_s;
  measurements.insert(measurements.end(), more.begin(), more.end());
  const auto join = [](auto& all, const auto& added) {
    all.insert(all.end(), added.begin(), added.end());
  };
  join(all_.equilibria, stretch.equilibria);
  join(all_.gated, stretch.gated);
  all_.signals = mixed(all_.signals, samples_, stretch.signals, samples);
  samples_ += samples;
  all_.static_poses = all_.kinematic_poses = 0;
  for (const Measurement& m : measurements) {
    (m.kind == PoseKind::static_pose ? all_.static_poses : all_.kinematic_poses)++;
  }
}

void OnlineCalibration::update() {
  CalibrationProblem& problem = all_.problem;
  CalibrationResult& result = all_.result;
  const auto& all = problem.measurements;
  bool fitted = false;
  // One that is not believed is no guess; one that is, all moments gave as well.
  if (calibration_.result.status == CalibrationStatus::converged &&
      result.poses.size() <= all.size()) {
    // New poses are estimated from where the last one was (§3.3), the others are known.
    std::vector<Pose> guess = result.poses;
    if (all.size() > guess.size()) {
      std::vector<Measurement> last{all.front()};
      const std::size_t from = std::max<std::size_t>(guess.size() - 1, 1);
      last.insert(last.end(), all.begin() + static_cast<std::ptrdiff_t>(from), all.end());
      const std::vector<Pose> estimated =
          measurement_guesses(robot_, last, guess.front(), problem.effects);
      guess.insert(guess.end(),
                   estimated.end() - static_cast<std::ptrdiff_t>(all.size() - guess.size()),
                   estimated.end());
    }
    CalibrationResult next = solve(problem, guess, options_.solve);
    fitted = next.status == CalibrationStatus::converged;
    if (fitted) result = std::move(next);
  }
  if (!fitted) {
    problem.noise.reset();
    result = solve_from_starts(problem, std::nullopt, options_.most_starts, options_.solve);
  }
  const auto poses = static_cast<double>(all.size());
  if (noise_source(options_) == NoiseSource::from_data &&
      (!fitted || poses >= kNoiseRenewal * noise_poses_)) {
    noise_poses_ = poses;
    refine_in_place(options_, all_);
  }
  calibration_ = all_;
  leave_independent_moments(options_, calibration_);
  look_around(calibration_.problem, calibration_.result);
  allow_for_effects(options_, calibration_);
  if (explain_) explain(calibration_.problem, calibration_.result);
}

}  // namespace cdprcal
