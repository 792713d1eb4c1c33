#include "cdprcal/diagnosis/motion.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace cdprcal {
namespace {

/// Least squares for one pose from one sample's readings, from a pose nearby. False: no solution.
bool follow(const DiagnosisModel& model, const Robot& robot, const ActiveEffects& active,
            const DiagnosisRun& run, const Measurement& m, Pose& pose) {
  constexpr int kMostSteps = 6;
  constexpr double kSettled = 1e-7;
  const int n = robot.cable_count();
  PoseEvaluation e;
  for (int step = 0; step < kMostSteps; ++step) {
    evaluate_pose(robot, m, pose, StaticsModel::none, {}, active, true, e);
    if (!e.valid) return false;
    Matrix6 hessian = Matrix6::Zero();
    Vector6 gradient = Vector6::Zero();
    const auto add = [&](double residual, const auto& row, NoiseGroup channel) {
      if (!std::isfinite(residual)) return;
      const double weight = std::pow(model.noise[static_cast<std::size_t>(channel)], -2);
      hessian.noalias() += weight * row.transpose() * row;
      gradient.noalias() += weight * residual * row.transpose();
    };
    for (int i = 0; i < n; ++i) {
      add(e.length_m[i] + run.offsets[i] - m.length_m[i], e.length_by_twist.row(i),
          NoiseGroup::moving_length);
      const double swivel = e.swivel_rad[i] + run.offsets[n + i] - m.swivel_rad[i];
      add(wrap_angle(swivel), e.swivel_by_twist.row(i), NoiseGroup::moving_swivel);
    }
    for (int a = 0; a < 3; ++a) {
      double angle = e.roll_pitch_yaw_rad[a] - m.roll_pitch_yaw_rad[a];
      if (a == 2) angle += run.offsets[2 * n];
      add(wrap_angle(angle), e.attitude_by_twist.row(a),
          a == 2 ? NoiseGroup::moving_yaw : NoiseGroup::moving_roll_pitch);
    }
    const double yaw = e.absolute_yaw_rad - m.absolute_yaw_rad;
    add(wrap_angle(yaw), e.absolute_yaw_by_twist, NoiseGroup::moving_absolute_yaw);
    for (Eigen::Index i = 0; i < m.direct_length_m.size(); ++i) {
      add(e.direct_length_m[i] - m.direct_length_m[i], e.direct_length_by_twist.row(i),
          NoiseGroup::moving_direct_length);
    }
    for (int a = 0; a < 3; ++a) {
      add(pose.position_m[a] - m.position_m[a], Vector6::Unit(a).transpose().eval(),
          NoiseGroup::moving_position);
    }
    const Eigen::LDLT<Matrix6> factors(hessian);
    if (factors.info() != Eigen::Success || !(factors.vectorD().minCoeff() > 0.0)) return false;
    const Vector6 twist = -factors.solve(gradient);
    pose = plus(pose, twist);
    if (twist.norm() < kSettled) return true;
  }
  return true;
}

struct Sample {
  Eigen::Index row;
  double speed;
  Pose pose;
  Measurement measurement;
};

/// Every sample of the run with its pose, followed from the first one, whose pose is known.
std::vector<Sample> followed(const DiagnosisModel& model, std::size_t r, const Log& log) {
  const SampleRange range = segments(log).back();
  const DiagnosisRun& run = model.runs[r];
  const ActiveEffects active = model.active(r);
  const Robot robot = with_effects(model.robot, active);
  const PathState path = path_state(log);
  std::vector<Sample> out;
  Pose pose = run.poses.front();
  for (Eigen::Index row = range.begin; row < range.end; ++row) {
    Sample sample{row, 0.0, pose, {}};
    sample.measurement =
        measurement_at(log, row, PoseKind::kinematic_pose, model.robot.cable_count());
    add_path(path, log, {row, row + 1}, log.time_s[range.begin], sample.measurement);
    if (!follow(model, robot, active, run, sample.measurement, sample.pose)) continue;
    pose = sample.pose;
    sample.speed = sample.measurement.attitude_rate_rad_s.norm();
    out.push_back(std::move(sample));
  }
  return out;
}

/// The fastest samples, none within the spacing of another.
void keep_fastest(std::vector<Sample>& samples, const Eigen::VectorXd& time_s,
                  const MotionOptions& options) {
  std::stable_sort(samples.begin(), samples.end(),
                   [](const Sample& a, const Sample& b) { return a.speed > b.speed; });
  std::vector<Sample> kept;
  for (Sample& sample : samples) {
    if (static_cast<int>(kept.size()) >= options.most_samples) break;
    const bool close = std::any_of(kept.begin(), kept.end(), [&](const Sample& other) {
      return std::abs(time_s[other.row] - time_s[sample.row]) < options.least_spacing_s;
    });
    if (!close) kept.push_back(std::move(sample));
  }
  std::stable_sort(kept.begin(), kept.end(),
                   [](const Sample& a, const Sample& b) { return a.row < b.row; });
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

DiagnosisModel with_motion(const DiagnosisModel& model, const std::vector<Log>& logs,
                           const MotionOptions& options) {
  constexpr double kLeastRate_Hz = 3.0;
  DiagnosisModel out = model;
  for (std::size_t r = 0; r < logs.size(); ++r) {
    const SampleRange range = segments(logs[r]).back();
    if (range.size() < 3) continue;
    const double duration_s = logs[r].time_s[range.end - 1] - logs[r].time_s[range.begin];
    if (!(static_cast<double>(range.size()) > kLeastRate_Hz * duration_s)) continue;
    std::vector<Sample> samples = followed(model, r, logs[r]);
    // What was read at rest is in the model already.
    std::erase_if(samples, [&](const Sample& sample) {
      return std::any_of(model.runs[r].rows.begin(), model.runs[r].rows.end(),
                         [&](const SampleRange& rest) {
                           return rest.begin <= sample.row && sample.row < rest.end;
                         });
    });
    keep_fastest(samples, logs[r].time_s, options);
    for (Sample& sample : samples) {
      out.runs[r].measurements.push_back(std::move(sample.measurement));
      out.runs[r].rows.push_back({sample.row, sample.row + 1});
      out.runs[r].poses.push_back(sample.pose);
    }
  }
  return out;
}

double motion_correlation(const DiagnosisModel& model) {
  const DiagnosisSystem system = linearise(model);
  double products = 0.0, squares = 0.0;
  Eigen::VectorXd last;
  for (const PoseSystem& pose : system.poses) {
    const Measurement& m = model.runs[pose.run].measurements[pose.pose];
    if (m.kind != PoseKind::kinematic_pose || m.samples != 1) {
      last.resize(0);
      continue;
    }
    const Eigen::VectorXd rows = pose.projection() * pose.reduced;
    if (rows.size() == last.size()) {
      products += rows.dot(last);
      squares += 0.5 * (rows.squaredNorm() + last.squaredNorm());
    }
    last = rows;
  }
  return squares > 0.0 ? products / squares : 0.0;
}

void refine_swivel_play(DiagnosisModel& model, const std::vector<Log>& logs) {
  constexpr int kMostRounds = 4;
  constexpr double kSettled = 0.01;  ///< relative change of the half-width
  constexpr double kWindow_s = 1.0;
  const auto term =
      std::find_if(model.effects.begin(), model.effects.end(),
                   [](const EffectTerm& t) { return t.effect->name() == "swivel_hysteresis"; });
  if (term == model.effects.end()) return;
  const int n = model.robot.cable_count();
  for (int round = 0; round < kMostRounds; ++round) {
    const double half_rad = std::abs(term->values[0]);
    if (!(half_rad > 0.0)) return;
    for (std::size_t r = 0; r < logs.size(); ++r) {
      DiagnosisRun& run = model.runs[r];
      const std::vector<Sample> samples = followed(model, r, logs[r]);
      if (samples.empty()) continue;
      const Robot robot = with_effects(model.robot, model.active(r));
      const auto count = static_cast<Eigen::Index>(samples.size());
      Eigen::MatrixXd swivel(count, n);
      Eigen::VectorXd time(count);
      for (Eigen::Index i = 0; i < count; ++i) {
        const Sample& sample = samples[static_cast<std::size_t>(i)];
        swivel.row(i) = platform_state(robot, sample.pose).swivel_rad();
        time[i] = logs[r].time_s[sample.row];
      }
      const Eigen::MatrixXd state = play(time, swivel, half_rad, kWindow_s);
      for (std::size_t m = 0; m < run.measurements.size(); ++m) {
        CableVector sum = CableVector::Zero(n);
        double inside = 0.0;
        for (Eigen::Index i = 0; i < count; ++i) {
          const Eigen::Index row = samples[static_cast<std::size_t>(i)].row;
          if (row < run.rows[m].begin || row >= run.rows[m].end) continue;
          sum += state.row(i).transpose();
          inside += 1.0;
        }
        if (!(inside > 0.0)) continue;
        run.measurements[m].swivel_direction = sum / inside;
        run.measurements[m].swivel_direction_error.setZero(n);
      }
    }
    if (!fit_with_noise(model)) return;
    if (std::abs(std::abs(term->values[0]) - half_rad) < kSettled * half_rad) return;
  }
}

}  // namespace cdprcal
