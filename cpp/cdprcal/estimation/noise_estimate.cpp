#include "cdprcal/estimation/noise_estimate.hpp"

#include <algorithm>
#include <boost/math/tools/minima.hpp>

#include "cdprcal/estimation/assembly.hpp"
#include "cdprcal/estimation/presence.hpp"
#include "cdprcal/statics/tension.hpp"

namespace cdprcal {
namespace {

/// One row: its variance is known + gain · (the component that is looked for).
struct Square {
  double value;    ///< residual²
  double freedom;  ///< of it
  double known;
  double gain;
};

/// What is known of a component beforehand, as so many readings of that size would say it. Weight
/// 0: nothing.
struct Prior {
  double value = 1.0;
  double weight = 0.0;
};

/// What is taken of a variance is the median of its posterior (scaled inverse χ²), as often too
/// small as too large: a sum of squares over their number less this.
constexpr double kOfMedian = 2.0 / 3.0;

/// What the robot file says counts as four readings.
Prior as_specified(double variance) {
  constexpr double kReadings = 4.0;
  return {variance * kReadings / (kReadings - kOfMedian), kReadings - kOfMedian};
}

double freedom_of(const std::vector<Square>& squares) {
  double sum = 0.0;
  for (const Square& s : squares) sum += s.freedom;
  return sum;
}

/// −2 log likelihood (times prior) of a variance component, up to a constant.
double deviance(const std::vector<Square>& squares, double component, const Prior& prior) {
  double sum =
      prior.weight > 0.0 ? prior.weight * (std::log(component) + prior.value / component) : 0.0;
  for (const Square& s : squares) {
    const double variance = s.known + s.gain * component;
    sum += s.freedom * std::log(variance) + s.value / variance;
  }
  return sum;
}

/// The component of greatest likelihood that is not below `least`.
double most_likely(const std::vector<Square>& squares, double least, const Prior& prior = {}) {
  // A row that hardly depends on the component says nothing of its size, however large it is.
  constexpr double kHardly = 1e-9;
  double most_gain = 0.0;
  for (const Square& s : squares) most_gain = std::max(most_gain, s.gain);
  double largest = prior.weight > 0.0 ? std::max(least, prior.value) : least;
  for (const Square& s : squares) {
    if (s.gain > kHardly * most_gain) largest = std::max(largest, s.value / s.gain);
  }
  if (!(largest > least)) return least;
  double low = std::log(std::max(least, 1e-12 * largest));
  const double high = std::log(4.0 * largest);
  // More than one hump may be: the best of a coarse scan, then its neighbourhood.
  constexpr int kScan = 48;
  const double step = (high - low) / kScan;
  double best = low, best_deviance = deviance(squares, std::exp(low), prior);
  for (int i = 1; i <= kScan; ++i) {
    const double at = low + i * step;
    if (const double d = deviance(squares, std::exp(at), prior); d < best_deviance) {
      best = at;
      best_deviance = d;
    }
  }
  const auto [at, found] = boost::math::tools::brent_find_minima(
      [&](double log_component) { return deviance(squares, std::exp(log_component), prior); },
      std::max(low, best - step), best + step, 30);
  const bool at_least = least > 0.0 || prior.weight == 0.0;
  return at_least && deviance(squares, least, prior) <= found ? least : std::exp(at);
}

/// Squares as if there were fewer of them, so that what is most likely is the median.
std::vector<Square> with_median(std::vector<Square> squares) {
  const double share = 1.0 - kOfMedian / freedom_of(squares);
  for (Square& s : squares) s.freedom *= share;
  return squares;
}

/// The pose component of a channel whose rows are readings. Residuals of exactly zero (made-up
/// data) must not give infinite weights: the component stays above `floor`.
double reading_component(const CalibrationProblem& problem, const std::vector<FittedRow>& rows,
                         Channel channel, const ChannelNoise& fitted, const Signal& signal,
                         double floor) {
  std::vector<Square> squares;
  for (const FittedRow& row : rows) {
    if (row.label.channel != channel) continue;
    const Measurement& m = problem.measurements[row.pose];
    const double value = fitted.sigma(m) * row.residual;
    squares.push_back({value * value, row.freedom, signal.variance(m.samples, m.run_time_s), 1.0});
  }
  if (freedom_of(squares) < 1.0) return kNaN;
  if (signal.sigma > 0.0) return std::sqrt(most_likely(with_median(squares), floor * floor));
  // Readings without neighbours (a list of rests) set no least to what their noise can be.
  const double specified = specified_noise(problem.robot.sigma)[channel].sigma(1);
  return std::sqrt(most_likely(squares, floor * floor, as_specified(specified * specified)));
}

/// How good lengths and swivels are at rests, of what the robot file says: the worse of the two,
/// at most 1. What the balance lacks is in the geometry mostly, and that they show too.
double share_of_specified(const CalibrationProblem& problem, const NoiseModel& found) {
  double samples = 0.0, rests = 0.0;
  for (const Measurement& m : problem.measurements) {
    if (m.kind != PoseKind::static_pose) continue;
    samples += m.samples;
    rests += 1.0;
  }
  const NoiseModel specified = specified_noise(problem.robot.sigma);
  double worst = 0.0;
  for (const Channel channel : {Channel::length, Channel::swivel}) {
    if (!is_read(problem.measurements, channel)) continue;
    const double mean = found[channel].sigma(static_cast<int>(samples / std::max(1.0, rests)));
    worst = std::max(worst, mean / specified[channel].sigma(1));
  }
  return worst > 0.0 ? std::min(1.0, worst) : 1.0;
}

/// Tension and model components of the balance together: alternately, each given the other.
void balance_components(const CalibrationProblem& problem, const std::vector<FittedRow>& rows,
                        const NoiseModel& fitted, const Signal& signal, BalanceError balance,
                        NoiseModel& out) {
  const ChannelNoise& tension = fitted[Channel::balance];
  struct Row {
    double value, freedom, gain, sample, inertial;
  };
  std::vector<Row> kept;
  double freedom = 0.0;
  for (const FittedRow& row : rows) {
    if (row.label.channel != Channel::balance) continue;
    const Measurement& m = problem.measurements[row.pose];
    const double sigma = tension.sigma(m);
    const double variance = sigma * sigma * row.tension_gain + 1.0;
    kept.push_back({variance * row.residual * row.residual, row.freedom, row.tension_gain,
                    signal.variance(m.samples, m.run_time_s), row.inertial_share});
    freedom += row.freedom;
  }
  if (freedom < 2.0) return;
  // A model exact to a hundredth of what the robot file says is as exact as anyone can ask.
  const double specified = std::pow(problem.robot.sigma.wrench_force_N / fitted.wrench_force_N, 2);
  const double least = 1e-4 * specified;
  // Where no load cell has a say (off the span of the cables) the balance fixes the pose so well
  // that few sensors can tell whether it is that good: a flat likelihood, which must not end at
  // `least`.
  const double share =
      balance == BalanceError::as_geometry ? share_of_specified(problem, out) : 1.0;
  const Prior prior = as_specified(std::max(least, share * share * specified));
  const double of_cells = problem.robot.sigma.tension_N;
  const Prior cells = signal.sigma > 0.0 ? Prior{} : as_specified(of_cells * of_cells);
  double pose = 0.0, model = 1.0;  // model: in units of the fitted one
  for (int round = 0; round < 10; ++round) {
    std::vector<Square> squares;
    for (const Row& r : kept)
      squares.push_back(
          {r.value, r.freedom, r.gain * (r.sample + pose) + r.inertial, 1.0 - r.inertial});
    model = most_likely(squares, least, prior);
    squares.clear();
    for (const Row& r : kept)
      squares.push_back({r.value, r.freedom,
                         r.gain * r.sample + r.inertial + model * (1.0 - r.inertial), r.gain});
    const double before = pose;
    pose = most_likely(squares, 0.0, cells);
    if (std::abs(pose - before) <= 1e-3 * (pose + signal.sigma * signal.sigma)) break;
  }
  out[Channel::balance] = {std::sqrt(pose), signal};
  out.wrench_force_N = std::sqrt(model) * fitted.wrench_force_N;
  out.wrench_moment_Nm = std::sqrt(model) * fitted.wrench_moment_Nm;
}

}  // namespace

NoiseModel noise_from_residuals(const CalibrationProblem& problem,
                                const std::vector<FittedRow>& rows, const Signals& signals,
                                BalanceError balance) {
  const NoiseModel fitted = problem.noise.value_or(specified_noise(problem.robot.sigma));
  const NoiseModel specified = specified_noise(problem.robot.sigma);
  NoiseModel out = fitted;
  const bool wrench = problem.statics == StaticsModel::wrench;
  for (std::size_t c = 0; c < kChannels; ++c) {
    const auto channel = static_cast<Channel>(c);
    if (channel == Channel::balance && wrench) continue;
    double floor = signals[c].sigma > 0.0 ? 0.0 : 1e-6 * specified.channel[c].sigma(1);
    if (row_of(channel).of().is_inertial()) floor = specified.channel[c].pose;  // its bias stays
    const double pose =
        reading_component(problem, rows, channel, fitted.channel[c], signals[c], floor);
    if (std::isfinite(pose)) out.channel[c] = {pose, signals[c]};
  }
  // What the model lacks acts through the cables, at the platform's anchors: the arm of its
  // moments.
  const double arm_m = characteristic_length_m(problem.robot);
  if (wrench && std::abs(fitted.wrench_moment_Nm - arm_m * fitted.wrench_force_N) >
                    1e-9 * fitted.wrench_moment_Nm) {
    out.wrench_moment_Nm = arm_m * out.wrench_force_N;  // a fit in these proportions comes first
  } else if (wrench) {
    balance_components(problem, rows, fitted, signals[static_cast<std::size_t>(Channel::balance)],
                       balance, out);
    if (out[Channel::balance].sigma(1) == 0.0) {
      out[Channel::balance].pose = 1e-6 * specified[Channel::balance].sigma(1);
    }
  }
  return out;
}

}  // namespace cdprcal
