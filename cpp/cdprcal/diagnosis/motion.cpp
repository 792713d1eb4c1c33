#include "cdprcal/diagnosis/motion.hpp"

#include <algorithm>

#include "cdprcal/estimation/elimination.hpp"
#include "cdprcal/readings/fresh.hpp"

namespace cdprcal {
namespace {

using lanes::kLanes;

/// Least squares for each pose of a batch from its own readings, from one pose nearby. Those that
/// have none become NaN.
class Follower {
 public:
  Follower(const DiagnosisModel& model, std::size_t run, std::vector<FollowedSample>& samples)
      : samples_(samples),
        at_(samples.size()),
        rows_(model.robot, readings(model, samples), {}),
        slots_(rows_.slots()),
        elimination_(kLanes, rows_.layout().offsets(), 0, true, rows_.free_motion().across()),
        none_(Eigen::VectorXd::Zero(rows_.layout().offsets())) {
    if (const ActiveEffects active = model.active(run); !active.empty()) {
      rows_.set_effects(with_effects(model.robot, active), active);
    }
    std::array<double, kChannels> weights{};
    for (std::size_t c = 0; c < kChannels; ++c) weights[c] = 1.0 / model.noise[c + kRestGroups];
    for (std::size_t i = 0; i < samples.size(); ++i) rows_.set_weights(i, weights);
    const OffsetVector offsets = -model.runs[run].offsets;
    rows_.set_offsets(offsets.data());
  }

  /// Poses of a batch, all from the same start.
  void follow(std::size_t batch, const Pose& start) {
    const std::size_t first = batch * kLanes;
    std::array<Pose, kLanes> poses;
    poses.fill(start);
    if (!iterate(batch, poses)) {  // one of them spoils the others' batch
      for (const std::size_t i : poses_of(batch, samples_.size())) {
        std::array<Pose, kLanes> alone;
        alone.fill(start);
        const bool found = iterate(batch, alone);
        poses[i - first] = found ? alone[i - first] : nowhere();
      }
    }
    for (const std::size_t i : poses_of(batch, samples_.size())) {
      const bool told = rows_.row_count(i) >= 6 && poses[i - first].position_m.allFinite();
      samples_[i].pose = told ? poses[i - first] : nowhere();
    }
  }

 private:
  static Pose nowhere() { return {Vector3::Constant(kNaN), Eigen::Quaterniond::Identity()}; }
  static RunReadings readings(const DiagnosisModel& model,
                              const std::vector<FollowedSample>& samples) {
    RunReadings out;
    for (const FollowedSample& sample : samples) out.measurements.push_back(&sample.measurement);
    out.statics.assign(samples.size(), StaticsModel::none);
    out.base = OffsetVector::Zero(2 * model.robot.cable_count() + 1);
    return out;
  }
  bool iterate(std::size_t batch, std::array<Pose, kLanes>& poses) {
    constexpr int kMostSteps = 10;
    constexpr double kSettled = 1e-7;
    const std::size_t first = batch * kLanes;
    for (int step = 0; step < kMostSteps; ++step) {
      for (const std::size_t i : poses_of(batch, samples_.size())) {
        at_.set(i, poses[i - first]);
      }
      if (!rows_.evaluate(batch, at_)) return false;
      elimination_.begin(1e-12, slots_);
      elimination_.add(rows_.rows(), rows_.by_offset(), rows_.by_effect());
      elimination_.back_substitute(none_);
      double largest = 0.0;
      for (const std::size_t i : poses_of(batch, samples_.size())) {
        const Vector6 twist = Eigen::Map<const Vector6, 0, Eigen::InnerStride<kLanes>>(
            elimination_.steps(0) + (i - first));
        poses[i - first] = plus(poses[i - first], twist);
        largest = std::max(largest, twist.norm());
      }
      if (largest < kSettled) break;
    }
    return true;
  }

  std::vector<FollowedSample>& samples_;
  PoseLanes at_;
  RunRows rows_;
  std::vector<int> slots_;
  PoseElimination elimination_;
  Eigen::VectorXd none_;
};

/// The fastest samples, none within the spacing of another.
void keep_fastest(std::vector<FollowedSample>& samples, const MotionOptions& options) {
  std::stable_sort(
      samples.begin(), samples.end(),
      [](const FollowedSample& a, const FollowedSample& b) { return a.speed > b.speed; });
  std::vector<FollowedSample> kept;
  for (FollowedSample& sample : samples) {
    if (static_cast<int>(kept.size()) >= options.most_samples) break;
    const bool close = std::any_of(kept.begin(), kept.end(), [&](const FollowedSample& other) {
      return std::abs(other.measurement.time_s - sample.measurement.time_s) <
             options.least_spacing_s;
    });
    if (!close) kept.push_back(std::move(sample));
  }
  std::stable_sort(kept.begin(), kept.end(),
                   [](const FollowedSample& a, const FollowedSample& b) { return a.row < b.row; });
  samples = std::move(kept);
}

/// State s in [−1, 1] of a play of this half-width that follows the angles [rows × n], smoothed
/// over a window: what lags behind them reads angle − s · half_rad.
Eigen::MatrixXd play(const Eigen::VectorXd& time_s, const Eigen::MatrixXd& angles, double half_rad,
                     double window_s) {
  Eigen::MatrixXd out(angles.rows(), angles.cols());
  Eigen::RowVectorXd lagging = angles.row(0), sum = Eigen::RowVectorXd::Zero(angles.cols());
  Eigen::Index begin = 0, end = 0;
  for (Eigen::Index i = 0; i < angles.rows(); ++i) {
    while (end < angles.rows() && time_s[end] <= time_s[i] + 0.5 * window_s)
      sum += angles.row(end++);
    while (time_s[begin] < time_s[i] - 0.5 * window_s) sum -= angles.row(begin++);
    const Eigen::RowVectorXd mean = sum / static_cast<double>(end - begin);
    lagging = lagging.cwiseMax((mean.array() - half_rad).matrix())
                  .cwiseMin((mean.array() + half_rad).matrix());
    out.row(i) = (mean - lagging) / half_rad;
  }
  return out;
}

}  // namespace

std::vector<FollowedSample> followed(const DiagnosisModel& model, std::size_t r, const Log& given) {
  const std::optional<Log> continuous = without_holds(given);  // sensors as of one time
  const Log& log = continuous ? *continuous : given;
  const SampleRange range = segments(log).back();
  const PathState path = path_state(model.robot, log);
  std::vector<FollowedSample> out(static_cast<std::size_t>(range.size()));
  for (std::size_t i = 0; i < out.size(); ++i) {
    FollowedSample& sample = out[i];
    sample.row = range.begin + static_cast<Eigen::Index>(i);
    sample.measurement =
        measurement_at(log, sample.row, PoseKind::kinematic_pose, model.robot.cable_count());
    add_path(path, log, {sample.row, sample.row + 1}, log.time_s[range.begin], sample.measurement);
    sample.speed = sample.measurement.attitude_rate_rad_s.norm();
  }
  if (out.empty()) return out;
  Follower follower(model, r, out);
  Pose pose = model.runs[r].poses.front();
  for (std::size_t b = 0; b < lanes::batches(out.size()); ++b) {
    follower.follow(b, pose);
    for (const std::size_t i : poses_of(b, out.size())) {
      if (out[i].pose.position_m.allFinite()) pose = out[i].pose;
    }
  }
  std::erase_if(out, [](const FollowedSample& s) { return !s.pose.position_m.allFinite(); });
  return out;
}

SampleRange samples_of(const std::vector<FollowedSample>& samples, const SampleRange& rows) {
  const auto at = [&](Eigen::Index row) {
    return std::ranges::lower_bound(samples, row, {}, &FollowedSample::row) - samples.begin();
  };
  return {at(rows.begin), at(rows.end)};
}

Log path_through(const DiagnosisModel& model, std::size_t run,
                 const std::vector<FollowedSample>& samples, const Log& log) {
  const Robot robot = with_effects(model.robot, model.active(run));
  const auto count = static_cast<Eigen::Index>(samples.size());
  Log path;
  path.time_s.resize(count);
  path.length_m.resize(count, robot.cable_count());
  path.swivel_rad.resize(count, robot.cable_count());
  for (Eigen::Index i = 0; i < count; ++i) {
    const FollowedSample& sample = samples[static_cast<std::size_t>(i)];
    const PlatformState state = platform_state(robot, sample.pose);
    path.time_s[i] = log.time_s[sample.row];
    path.length_m.row(i) = state.length_m();
    path.swivel_rad.row(i) = state.swivel_rad();
  }
  return path;
}

MovingSamples moving_samples(const DiagnosisModel& model, const std::vector<Log>& logs) {
  constexpr double kLeastRate_Hz = 3.0;
  MovingSamples out(logs.size());
  for (std::size_t r = 0; r < logs.size(); ++r) {
    const SampleRange range = segments(logs[r]).back();
    if (range.size() < 3) continue;
    const double duration_s = logs[r].time_s[range.end - 1] - logs[r].time_s[range.begin];
    if (!(static_cast<double>(range.size()) > kLeastRate_Hz * duration_s)) continue;
    out[r] = followed(model, r, logs[r]);
    // What was read at rest is in the model already.
    std::erase_if(out[r], [&](const FollowedSample& sample) {
      return std::any_of(model.runs[r].rows.begin(), model.runs[r].rows.end(),
                         [&](const SampleRange& rest) {
                           return rest.begin <= sample.row && sample.row < rest.end;
                         });
    });
  }
  return out;
}

DiagnosisModel with_motion(const DiagnosisModel& model, MovingSamples samples,
                           const MotionOptions& options) {
  DiagnosisModel out = model;
  for (std::size_t r = 0; r < samples.size(); ++r) {
    keep_fastest(samples[r], options);
    for (FollowedSample& sample : samples[r]) {
      out.runs[r].measurements.push_back(std::move(sample.measurement));
      out.runs[r].rows.push_back({sample.row, sample.row + 1});
      out.runs[r].poses.push_back(sample.pose);
    }
  }
  return out;
}

void refine_swivel_play(DiagnosisModel& model, const std::vector<Log>& logs) {
  constexpr int kMostRounds = 4;
  constexpr double kSettled = 0.01;  ///< relative change of the half-width
  constexpr double kWindow_s = 1.0;
  const auto term =
      std::find_if(model.effects.begin(), model.effects.end(),
                   [](const EffectTerm& t) { return t.effect->info().of_swivel_play; });
  if (term == model.effects.end()) return;
  const int n = model.robot.cable_count();
  for (int round = 0; round < kMostRounds; ++round) {
    const Eigen::VectorXd half_rad = term->values.cwiseAbs();  // one number, or one a log
    if (!(half_rad.maxCoeff() > 0.0)) return;
    for (std::size_t r = 0; r < logs.size(); ++r) {
      DiagnosisRun& run = model.runs[r];
      const double own_rad = half_rad[term->begin_of(r, n)];
      const std::vector<FollowedSample> samples = followed(model, r, logs[r]);
      if (samples.empty() || !(own_rad > 0.0)) continue;
      const Log path = path_through(model, r, samples, logs[r]);
      const Eigen::MatrixXd state = play(path.time_s, path.swivel_rad, own_rad, kWindow_s);
      for (std::size_t m = 0; m < run.measurements.size(); ++m) {
        const SampleRange inside = samples_of(samples, run.rows[m]);
        if (inside.size() < 1) continue;
        run.measurements[m].swivel_direction =
            state.middleRows(inside.begin, inside.size()).colwise().mean();
        run.measurements[m].swivel_direction_error.setZero(n);
      }
    }
    if (!fit_with_noise(model)) return;
    const Eigen::VectorXd change_rad = term->values.cwiseAbs() - half_rad;
    if ((change_rad.cwiseAbs().array() <= kSettled * half_rad.array()).all()) return;
  }
}

}  // namespace cdprcal
