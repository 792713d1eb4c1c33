#include "cdprcal/motion/swings.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <complex>
#include <optional>

#include "cdprcal/motion/locked.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal {
namespace {

constexpr double kMost_s = 60.0, kFewestSwings = 4.0;
/// A mode of the model and the one that was measured are of the same kind within this factor.
constexpr double kAlike = 1.5;
/// A peak of the spectrum is this many times its median; or, in a stretch so short that peaks fill
/// the spectrum, has this share of the motion, which is much larger than what is known of it.
constexpr double kPeak = 30.0, kLargeShare = 0.2, kWellSeen = 25.0;
/// A peak has the shape of a mode that holds so much of its energy.
constexpr double kItsShape = 0.5;
/// Larger swings are slower than their mode [rad].
constexpr double kSmall_rad = 0.25;

/// The longest time, up to a minute, in which no winch turns and the platform swings gently.
LockedStretch longest(const Calibration& calibration, const CorrectedRun& run,
                      std::span<const SmoothedSample> path) {
  const auto gently = [&](std::size_t begin, std::size_t i) {
    return path[i].time_s - path[begin].time_s <= kMost_s &&
           minus(path[i].state.pose, path[begin].state.pose).tail<3>().norm() <= kSmall_rad;
  };
  LockedStretch out;
  for (const LockedStretch& stretch : locked_stretches(calibration, run, path, gently)) {
    if (lasts_s(stretch, path) > lasts_s(out, path)) out = stretch;
  }
  return out;
}

/// Of the poses of a calibration within a time: they balance, where those of a path need not.
std::optional<Pose> mean_pose(const Calibration& calibration, double from_s, double until_s) {
  std::optional<Pose> mean;
  for (int round = 0; round < 3; ++round) {
    Vector6 away = Vector6::Zero();
    double count = 0.0;
    for (std::size_t i = 0; i < calibration.result.poses.size(); ++i) {
      const double time_s = calibration.problem.measurements[i].time_s;
      const Pose& pose = calibration.result.poses[i];
      if (!(time_s >= from_s && time_s <= until_s && pose.position_m.allFinite())) continue;
      if (!mean) mean = pose;
      away += minus(pose, *mean);
      count += 1.0;
    }
    if (mean) mean = plus(*mean, away / count);
  }
  return mean;
}

/// Amplitudes of the rows of a motion at a frequency, as Hann's window shows them.
Eigen::VectorXcd amplitude(const Eigen::MatrixXd& motion, const Eigen::VectorXd& time_s,
                           const Eigen::VectorXd& window, double hz) {
  const Eigen::VectorXcd wave =
      time_s.unaryExpr([&](double t) { return std::polar(1.0, -2.0 * kPi * hz * t); });
  return motion * window.cwiseProduct(wave) * (2.0 / window.sum());
}

/// Frequencies at which a spectrum has its maxima, each between its neighbours. `large`: of power
/// that is no noise.
std::vector<double> peaks(const Eigen::VectorXd& power, double step_hz, double large) {
  std::vector<double> sorted(power.begin(), power.end());
  const double least = std::min(large, kPeak * median(sorted));
  std::vector<double> out;
  for (Eigen::Index k = 1; k + 1 < power.size(); ++k) {
    const double before = power[k - 1], at = power[k], after = power[k + 1];
    if (!(at > least && at >= before && at > after)) continue;
    // A parabola through the logarithms, which is nearly exact for this window.
    const double a = std::log(before), b = std::log(at), c = std::log(after);
    out.push_back(step_hz * (static_cast<double>(k) + 0.5 * (a - c) / (a - 2.0 * b + c)));
  }
  return out;
}

}  // namespace

std::vector<Swing> swings(const Calibration& calibration, const CorrectedRun& run,
                          std::span<const SmoothedSample> path) {
  const Robot robot = with_effects(calibration.problem.robot, calibration.problem.effects);
  const LockedStretch stretch = longest(calibration, run, path);
  const auto samples = static_cast<Eigen::Index>(stretch.end - stretch.begin);
  if (samples < 2) return {};
  const std::span<const SmoothedSample> still =
      path.subspan(stretch.begin, stretch.end - stretch.begin);
  const std::optional<Pose> middle =
      mean_pose(calibration, still.front().time_s, still.back().time_s);
  if (!middle) return {};
  const Pose& mean = *middle;
  const PlatformState state = platform_state(robot, mean);
  if (!state.valid) return {};
  const Modes modes = modes_at(robot, mean);
  const ModeVector& model_hz = modes.natural_frequency_hz;
  const double lasts_s = cdprcal::lasts_s(stretch, path);
  if (model_hz.size() == 0 || !(model_hz.minCoeff() * lasts_s > kFewestSwings)) return {};

  // In coordinates of the modes, in which all have the same mass.
  const Matrix6 mass = mass_matrix(robot, state);
  const Eigen::MatrixXd to_modes = modes.shape.transpose() * mass;
  double noise = 0.0;
  Eigen::MatrixXd motion(model_hz.size(), samples);
  Eigen::VectorXd time_s(samples), window(samples);
  for (Eigen::Index k = 0; k < samples; ++k) {
    const SmoothedSample& s = still[static_cast<std::size_t>(k)];
    time_s[k] = s.time_s - still.front().time_s;
    motion.col(k) = to_modes * minus(s.state.pose, mean);
    noise += (to_modes * s.covariance.topLeftCorner<6, 6>() * to_modes.transpose()).trace();
    window[k] = 1.0 - std::cos(2.0 * kPi * time_s[k] / lasts_s);
  }
  const double step_hz = 0.25 / lasts_s, most_hz = kAlike * model_hz.maxCoeff();
  Eigen::VectorXd power(static_cast<Eigen::Index>(most_hz / step_hz) + 2);
  for (Eigen::Index k = 0; k < power.size(); ++k) {
    power[k] = amplitude(motion, time_s, window, step_hz * static_cast<double>(k)).squaredNorm();
  }
  // A sine of amplitude a has the variance a²/2.
  const double all = motion.squaredNorm(), each = 2.0 / static_cast<double>(samples);
  const double large = all > kWellSeen * noise ? kLargeShare * each * all : HUGE_VAL;
  struct Pair {
    Eigen::Index mode;
    double hz, share;  ///< of the peak's energy that is in the mode
  };
  std::vector<Pair> pairs;
  for (const double hz : peaks(power, step_hz, large)) {
    const Eigen::VectorXd energy = amplitude(motion, time_s, window, hz).cwiseAbs2();
    for (Eigen::Index m = 0; m < energy.size(); ++m) {
      if (hz < kAlike * model_hz[m] && model_hz[m] < kAlike * hz) {
        pairs.push_back({m, hz, energy[m] / energy.sum()});
      }
    }
  }
  std::vector<Swing> out;
  for (Eigen::Index m = 0; m < model_hz.size(); ++m) {
    const double size = std::sqrt(motion.row(m).squaredNorm() / static_cast<double>(samples));
    out.push_back({model_hz[m], kNaN, size / std::sqrt(robot.platform.mass_kg)});
  }
  std::ranges::sort(pairs, [](const Pair& a, const Pair& b) { return a.share > b.share; });
  while (!pairs.empty() && pairs.front().share > kItsShape) {
    const Pair best = pairs.front();
    out[static_cast<std::size_t>(best.mode)].measured_hz = best.hz;
    std::erase_if(pairs, [&](const Pair& p) { return p.mode == best.mode || p.hz == best.hz; });
  }
  return out;
}

}  // namespace cdprcal
