#include "cdprcal/calibration/refine.hpp"

#include <algorithm>
#include <optional>
#include <tuple>

#include "cdprcal/effects/applied.hpp"
#include "cdprcal/estimation/assembly.hpp"
#include "cdprcal/estimation/noise_estimate.hpp"
#include "cdprcal/statics/taut.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal {
namespace {

/// Probability with which a clean log loses any reading at all to the outlier gate.
constexpr double kFamilyWise = 0.01;
/// Outliers are few: a channel with a larger share beyond the gate is not made of them, its model
/// is wrong, and nothing of it is gated.
constexpr double kLargestShare = 0.05;
constexpr int kMostRounds = 20;

std::vector<FittedRow> rows_of(const CalibrationProblem& problem, const CalibrationResult& result) {
  Assembly assembly(problem, result.poses);
  assembly.set_reference_errors(result.reference_errors);
  assembly.poses().update_wrench_whitening(1.0);
  return assembly.fitted_rows();
}

/// Takes one reading out of its measurement; a balance goes as a whole.
void leave_out(Measurement& m, const RowLabel& label) {
  if (label.channel == Channel::balance) {
    m.balance_counts = false;
    return;
  }
  readings_of(m, row_of(label.channel).of())[static_cast<std::size_t>(label.component)] = kNaN;
}

/// Rows beyond what the channel's own scatter makes believable: standardised residuals over a
/// robust scale (median of squares), and over the scale of all that is within, which fewer rows
/// leave less uncertain; each against a Bonferroni bound over all rows. The worst of each pose.
std::vector<FittedRow> outliers(const std::vector<FittedRow>& rows) {
  constexpr double kLeastFreedom = 0.05;  // less: the fit follows the reading, nothing to see
  constexpr double kMedianChiSquare = 0.4549364;  // of one degree of freedom
  const double probability = 0.5 * kFamilyWise / static_cast<double>(rows.size());
  const double bound = normal_quantile(1.0 - probability);
  std::vector<FittedRow> out;
  for (std::size_t c = 0; c < kChannels; ++c) {
    std::vector<FittedRow> own;
    std::vector<double> squares;
    for (FittedRow row : rows) {
      if (row.label.channel != static_cast<Channel>(c) || row.label.of_reference) continue;
      if (row.freedom < kLeastFreedom) continue;
      row.residual /= std::sqrt(row.freedom);
      squares.push_back(row.residual * row.residual);
      own.push_back(row);
    }
    if (own.size() < 10) continue;  // no scale to speak of
    double scale = std::sqrt(median(squares) / kMedianChiSquare);
    // A balance has rows of two kinds, and those off the span of the cables may well be better than
    // modelled (noise_estimate.hpp): they do not make the others outliers.
    if (static_cast<Channel>(c) == Channel::balance) scale = std::max(scale, 1.0);
    if (!(scale > 0.0)) continue;
    const double robust = bound * scale;
    double within = 0.0, sum = 0.0;
    for (const double square : squares) {
      if (square > robust * robust) continue;
      ++within;
      sum += square;
    }
    const auto all = static_cast<double>(squares.size());
    if (all - within > kLargestShare * all) continue;
    // The scale is of so many rows, so Student's distribution has that many degrees of freedom.
    const double student = student_quantile(1.0 - probability, within);
    const double least = std::max(robust, student * std::sqrt(sum / within));
    std::erase_if(own, [&](const FittedRow& row) { return std::abs(row.residual) <= least; });
    for (FittedRow& row : own) row.residual /= scale;
    out.insert(out.end(), own.begin(), own.end());
  }
  // One wrong reading drags its pose along and makes its neighbours look wrong: only the worst of a
  // pose goes, then all is fitted anew.
  std::stable_sort(out.begin(), out.end(), [](const FittedRow& a, const FittedRow& b) {
    return a.pose != b.pose ? a.pose < b.pose : std::abs(a.residual) > std::abs(b.residual);
  });
  out.erase(std::unique(out.begin(), out.end(),
                        [](const FittedRow& a, const FittedRow& b) { return a.pose == b.pose; }),
            out.end());
  return out;
}

/// Largest change of any channel's σ (of single samples), as a ratio's logarithm.
double change(const NoiseModel& a, const NoiseModel& b) {
  double largest = 0.0;
  for (std::size_t c = 0; c < kChannels; ++c) {
    largest = std::max(largest, std::abs(std::log(a.channel[c].sigma(1) / b.channel[c].sigma(1))));
  }
  return std::max(largest, std::abs(std::log(a.wrench_moment_Nm / b.wrench_moment_Nm)));
}

/// Halfway, as ratios go.
NoiseModel between(const NoiseModel& a, const NoiseModel& b) {
  const auto mean = [](double x, double y) {
    return x > 0.0 && y > 0.0 ? std::sqrt(x * y) : 0.5 * (x + y);
  };
  NoiseModel out;
  for (std::size_t c = 0; c < kChannels; ++c) {
    out.channel[c] = {mean(a.channel[c].pose, b.channel[c].pose), b.channel[c].sample};
    out.channel[c].sample.sigma = mean(a.channel[c].sample.sigma, b.channel[c].sample.sigma);
  }
  out.wrench_force_N = mean(a.wrench_force_N, b.wrench_force_N);
  out.wrench_moment_Nm = mean(a.wrench_moment_Nm, b.wrench_moment_Nm);
  return out;
}

/// The model's wrench error and the poses explain each other, so a small one is approached slowly:
/// what shrinks twice in a row takes three steps at once. Too far is put right at once from below.
void hasten(const NoiseModel& before, bool& shrinks, NoiseModel& next) {
  const double ratio = next.wrench_force_N / before.wrench_force_N;
  const bool again = ratio < 1.0 && shrinks;
  shrinks = ratio < 1.0;
  if (!again) return;
  next.wrench_force_N *= ratio * ratio;
  next.wrench_moment_Nm *= ratio * ratio;
}

/// Whether load cells are off by more than their noise: cables cannot push, and a mean of several
/// readings says that one does, or more than one reading (one may be an outlier).
bool cables_push(const CalibrationProblem& problem, double tension_noise_N) {
  int pushing = 0;
  for (const Measurement& m : problem.measurements) {
    const double limit_N = pushing_below_N(problem.robot, tension_noise_N / std::sqrt(m.samples));
    const CableVector tension_N = true_tension_N(problem.robot, problem.effects, m);
    const auto pushes = (tension_N.array() < limit_N).count();
    pushing += static_cast<int>(pushes) * (m.samples > 1 ? 2 : 1);
  }
  return pushing > 1;
}

}  // namespace

std::vector<GatedReading> gate_slack(CalibrationProblem& problem, const Signals& signals) {
  const Robot& robot = problem.robot;
  const Signal& of_rows = signals[static_cast<std::size_t>(Channel::balance)];
  const double noise_N = of_rows.sigma * std::sqrt(of_rows.rows);
  const double least_sigma_N = cables_push(problem, noise_N) ? robot.sigma.tension_N : 0.0;
  std::vector<GatedReading> gated;
  for (Measurement& m : problem.measurements) {
    const double sigma_N = std::max(least_sigma_N, noise_N / std::sqrt(m.samples));
    const double level_N = slack_level_N(robot, sigma_N);
    bool any = false;
    const CableVector tension_N = true_tension_N(robot, problem.effects, m);
    for (Eigen::Index c = 0; c < tension_N.size(); ++c) {
      if (!(tension_N[c] < level_N)) continue;
      gated.push_back({GatedReading::Reason::slack, m.time_s, Channel::balance, static_cast<int>(c),
                       tension_N[c]});
      m.length_m[c] = m.swivel_rad[c] = kNaN;
      any = true;
    }
    if (any) m.balance_counts = false;
  }
  return gated;
}

SolveOptions on_the_way(const SolveOptions& options) {
  SolveOptions out = loosened(options, 1e-8, 1e-6);
  out.explain = false;
  return out;
}

Refinement refine(const CalibrationProblem& problem, const CalibrationResult& fit,
                  const Signals& signals, const SolveOptions& solve_options, BalanceError balance) {
  Refinement out{problem, fit, {}};
  // With the noise that the readings show, a covariance may well hold as far as it reaches.
  if (fit.status != CalibrationStatus::converged && !fit.curved) return out;
  double solve_time_s = fit.solve_time_s;
  int iterations = fit.iterations;
  bool shrinks = false, rough = false;
  std::optional<CalibrationResult> failed;
  for (int round = 0; round < kMostRounds; ++round) {
    const std::vector<FittedRow> rows = rows_of(out.problem, out.result);
    if (rows.empty()) break;
    const NoiseModel before = out.problem.noise.value_or(specified_noise(problem.robot.sigma));
    CalibrationProblem next = out.problem;
    next.noise = noise_from_residuals(out.problem, rows, signals, balance);
    const bool settled = round > 0 && change(*next.noise, before) < 0.01;
    hasten(before, shrinks, *next.noise);
    std::vector<GatedReading> gated;
    if (round > 0) {
      for (const FittedRow& row : outliers(rows)) {
        Measurement& m = next.measurements[row.pose];
        leave_out(m, row.label);
        gated.push_back({GatedReading::Reason::outlier, m.time_s, row.label.channel,
                         row.label.channel == Channel::balance ? 0 : row.label.component,
                         std::abs(row.residual)});
      }
      if (settled && gated.empty()) break;
    }
    CalibrationResult result;
    // A long step to much smaller noise may lose the minimum: shorter ones then.
    constexpr int kMostHalvings = 4;
    for (int halving = 0; halving <= kMostHalvings; ++halving) {
      result = solve(next, out.result.poses, on_the_way(solve_options));
      solve_time_s += result.solve_time_s;
      iterations += result.iterations;
      if (result.status == CalibrationStatus::converged) break;
      next.noise = between(before, *next.noise);
    }
    if (result.status != CalibrationStatus::converged) {
      failed = std::move(result);
      break;
    }
    out.problem = std::move(next);
    out.result = std::move(result);
    rough = true;
    out.gated.insert(out.gated.end(), gated.begin(), gated.end());
  }
  if (rough) {  // the noise has settled: now in earnest
    CalibrationResult result = solve(out.problem, out.result.poses, solve_options);
    solve_time_s += result.solve_time_s;
    iterations += result.iterations;
    if (result.status == CalibrationStatus::converged) out.result = std::move(result);
  }
  if (failed) {
    // A model so wrong that only the specified noise, far from what the readings show, hid it.
    if (failed->status == CalibrationStatus::not_converged && failed->covariance) {
      out.result.status = failed->status;
      out.result.reason = "with the noise that the readings show, " + failed->reason;
    } else {  // the last that stood stands
      out.result.reason += "; the noise could not be taken from the readings (" + failed->reason +
                           "), so the weights are the specified ones or those of an earlier round";
    }
  }
  // Several rows of one balance are one reading left out.
  std::stable_sort(out.gated.begin(), out.gated.end(), [](const auto& a, const auto& b) {
    return std::tie(a.time_s, a.channel, a.component) < std::tie(b.time_s, b.channel, b.component);
  });
  out.gated.erase(std::unique(out.gated.begin(), out.gated.end(),
                              [](const auto& a, const auto& b) {
                                return std::tie(a.time_s, a.channel, a.component) ==
                                       std::tie(b.time_s, b.channel, b.component);
                              }),
                  out.gated.end());
  out.result.solve_time_s = solve_time_s;
  out.result.iterations = iterations;
  return out;
}

const char* to_string(GatedReading::Reason reason) {
  return reason == GatedReading::Reason::slack ? "slack" : "outlier";
}

}  // namespace cdprcal
