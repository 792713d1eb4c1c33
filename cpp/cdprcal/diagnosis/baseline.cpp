#include "cdprcal/diagnosis/baseline.hpp"

#include <algorithm>

#include "cdprcal/diagnosis/events.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

/// Below this share of the least tension allowed a cable carries nothing worth balancing.
constexpr double kSlackShare = 0.1;

/// Adds the mean squared noise of one reading, from its ripple at each rest and in motion alike.
void add_ripple(const Log& log, const SampleRange& run, NoiseLevels& sums) {
  const auto group = [&](const LogMatrix& values, int from, int to, bool angles) {
    double sum = 0.0;
    int count = 0;
    for (int c = from; c < std::min<int>(to, static_cast<int>(values.cols())); ++c) {
      const double noise = channel_noise(values.col(c).segment(run.begin, run.size()), angles);
      sum += noise * noise;
      ++count;
    }
    return count > 0 ? sum / count : 0.0;
  };
  const int n = static_cast<int>(log.length_m.cols());
  sums[0] += group(log.length_m, 0, n, false);
  sums[1] += group(log.swivel_rad, 0, n, true);
  sums[2] += group(log.roll_pitch_yaw_rad, 0, 2, true);
  sums[3] += group(log.roll_pitch_yaw_rad, 2, 3, true);
  sums[4] += group(log.tension_N, 0, n, false);
  sums[5] += group(log.absolute_yaw_rad, 0, 1, true);
  sums[6] += group(log.direct_length_m, 0, n, false);
  sums[7] += group(log.position_m, 0, 3, false);
}

/// The balance needs every cable: without it where one hangs slack.
void gate_slack(const Robot& robot, Measurement& m) {
  for (double& tension_N : m.tension_N) {
    if (tension_N < kSlackShare * robot.tension_min_N) tension_N = kNaN;
  }
}

/// The rows behind each measurement: those of the next rest, or one.
std::vector<SampleRange> rows_of(const Log& log, const Calibration& calibration) {
  std::vector<SampleRange> out;
  auto rest = calibration.equilibria.begin();
  for (const Measurement& m : calibration.problem.measurements) {
    if (m.kind == PoseKind::static_pose && rest != calibration.equilibria.end()) {
      out.push_back(rest++->samples);
      continue;
    }
    const double* begin = log.time_s.data();
    const Eigen::Index row = std::lower_bound(begin, begin + log.time_s.size(), m.time_s) - begin;
    out.push_back({row, row + 1});
  }
  return out;
}

/// Poses of a log as a run with its calibrated start.
DiagnosisRun run_from(const Robot& robot, const Log& log) {
  CalibrateOptions options;
  options.method = log.tension_N.cols() > 0 ? Method::statics : Method::kinematic;
  options.noise = NoiseSource::specified;  // the diagnosis has its own, with the effects in it
  const Calibration calibration = calibrate(robot, log, options);
  if (calibration.result.poses.empty()) {
    throw InputError(log.source + ": the baseline calibration failed: " +
                     calibration.result.reason + "; run cdprcal check");
  }
  DiagnosisRun run;
  run.name = log.source;
  run.measurements = calibration.problem.measurements;
  run.poses = calibration.result.poses;
  run.rows = rows_of(log, calibration);
  run.known = calibration.problem.effects;
  for (Measurement& m : run.measurements) gate_slack(robot, m);
  const int n = robot.cable_count();
  run.offsets.setZero(2 * n + 1);
  const PlatformState initial = platform_state(robot, run.poses.front());
  const Measurement& first = run.measurements.front();
  const Vector3 angles = euler_from_rotation(initial.rotation, robot.euler_convention);
  for (int i = 0; i < n; ++i) {
    const double length = first.length_m[i] - initial.cable[i].length_m;
    const double swivel = first.swivel_rad[i] - initial.cable[i].swivel_rad;
    run.offsets[i] = std::isfinite(length) ? length : 0.0;
    run.offsets[n + i] = std::isfinite(swivel) ? swivel : 0.0;
  }
  const double yaw = first.roll_pitch_yaw_rad[2] - angles[2];
  run.offsets[2 * n] = std::isfinite(yaw) ? yaw : 0.0;
  return run;
}

/// Readings behind an average rest.
double mean_samples(const DiagnosisModel& model) {
  double samples = 0.0;
  int rests = 0;
  for (const DiagnosisRun& run : model.runs) {
    for (const Measurement& m : run.measurements) {
      if (m.kind == PoseKind::kinematic_pose && m.samples == 1) continue;
      samples += m.samples;
      ++rests;
    }
  }
  return rests > 0 ? samples / rests : 1.0;
}

}  // namespace

DiagnosisModel baseline_model(const Robot& robot, std::vector<Log>& logs,
                              std::vector<std::string>& left_out) {
  DiagnosisModel model;
  model.robot = robot;
  NoiseLevels squares{};
  for (Log& log : logs) {
    for (const LogEvent& event : gate_events(robot, log)) {
      left_out.push_back(log.source + ": " + describe(event));
    }
    model.runs.push_back(run_from(robot, log));
    add_ripple(log, segments(log).back(), squares);
  }
  model.rest_samples = mean_samples(model);
  const NoiseModel specified = specified_noise(robot.sigma);
  for (std::size_t c = 0; c < kRestGroups; ++c) {
    const double sigma = specified.channel[c].pose;
    // A thousandth of σ keeps noise-free data from a division by zero.
    const double reading =
        std::max(std::sqrt(squares[c] / static_cast<double>(logs.size())), 1e-3 * sigma);
    const double mean = std::max(reading / std::sqrt(model.rest_samples), 1e-3 * sigma);
    const bool balance = c == static_cast<std::size_t>(NoiseGroup::balance);
    const double unit = balance ? sigma : 1.0;
    model.floor[c] = mean / unit;
    model.noise[c] = sigma / unit;
    if (!balance) {
      model.floor[c + kRestGroups] = reading;
      model.noise[c + kRestGroups] = sigma;
    }
  }
  if (!fit_with_noise(model)) {
    left_out.emplace_back("the baseline fit did not settle: results are to be taken with care");
  }
  return model;
}

}  // namespace cdprcal
