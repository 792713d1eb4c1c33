#include "cdprcal/calibration/unsettled_start.hpp"

#include <algorithm>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/effects/pose_evaluation.hpp"
#include "cdprcal/readings/still.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal {
namespace {

/// The changes between the first sample and the mean of later ones: the squares that a change of
/// pose explains, those that it leaves, and their degrees of freedom; and the largest.
struct Change {
  double explained = 0.0, left = 0.0, largest = 0.0;
  int explained_freedom = 0, left_freedom = 0;
  [[nodiscard]] double all() const { return explained + left; }
  [[nodiscard]] int freedom() const { return explained_freedom + left_freedom; }
};
/// `e`: of the initial pose. `signals`: of the run, as they come once filters have run in.
Change change_between(const Log& log, Eigen::Index first, const SampleRange& later,
                      const PoseEvaluation& e, const Signals& signals) {
  std::vector<double> changes;
  std::vector<Vector6> by_twist;
  const auto add = [&](const LogMatrix& readings, Channel channel, bool angles, Eigen::Index column,
                       const Vector6& row) {
    if (column >= readings.cols()) return;
    Eigen::VectorXd values(later.size() + 1);
    values << readings(first, column), readings.col(column).segment(later.begin, later.size());
    if (angles) values = unwrapped(values);
    const auto read = values.tail(later.size()).array().isFinite();
    const auto count = static_cast<double>(read.count());
    const double mean = read.select(values.tail(later.size()), 0.0).sum() / count;
    const double change = values[0] - mean;
    const Signal& signal = signals[static_cast<std::size_t>(channel)];
    const double sigma = std::sqrt(signal.variance(1.0) + signal.variance(count));
    if (!std::isfinite(change) || !(sigma > 0.0)) return;
    changes.push_back(change / sigma);
    by_twist.emplace_back(row / sigma);
  };
  for (Eigen::Index c = 0; c < e.length_m.size(); ++c) {
    add(log.length_m, Channel::length, false, c, e.length_by_twist.row(c));
    add(log.swivel_rad, Channel::swivel, true, c, e.swivel_by_twist.row(c));
  }
  for (Eigen::Index a = 0; a < 3; ++a) {
    add(log.roll_pitch_yaw_rad, a < 2 ? Channel::roll_pitch : Channel::yaw, true, a,
        e.attitude_by_twist.row(a));
  }
  const auto count = static_cast<Eigen::Index>(changes.size());
  if (count <= 6) return {};
  Eigen::MatrixXd jacobian(count, 6);
  for (Eigen::Index i = 0; i < count; ++i) {
    jacobian.row(i) = by_twist[static_cast<std::size_t>(i)];
  }
  const Eigen::VectorXd change = Eigen::Map<const Eigen::VectorXd>(changes.data(), count);
  const auto [step, rank] = least_squares(jacobian, change);
  const double left = (change - jacobian * step).squaredNorm();
  return {change.squaredNorm() - left, left, change.cwiseAbs2().maxCoeff(), static_cast<int>(rank),
          static_cast<int>(count - rank)};
}

/// Whether one reading is odd, no motion makes it so, and all others say that nothing moved.
bool one_is_odd(const Change& change) {
  constexpr double kNoise = 0.95, kOdd = 0.999;
  if (change.left_freedom < 1) return false;
  const double others = change.all() - change.largest;
  return change.all() > chi_square_quantile(kOdd, change.freedom()) &&
         change.left > chi_square_quantile(kNoise, change.left_freedom) &&
         others <= chi_square_quantile(kNoise, change.freedom() - 1);
}

/// Whether a sample is off from later ones by more than noise and a motion of the platform.
/// `settled`: those have forgotten what a filter began with, or are many, and show no motion. That
/// a platform came to rest in just that time is not to be expected: any change is enough, but for a
/// large one that only a motion makes.
bool contradicts(const Change& change, bool settled) {
  constexpr double kConfidence = 0.999;
  // Errors are spread over all directions. A motion is along its own but for its curvature: of a
  // tenth of the cables' length it leaves a hundredth in squares.
  constexpr double kMotion = 100.0;
  if (one_is_odd(change)) return true;
  if (change.left_freedom < 1) return false;
  const double square = settled ? change.all() : change.left;
  const int freedom = settled ? change.freedom() : change.left_freedom;
  const double left = std::max(1.0, change.left / change.left_freedom);
  return square > chi_square_quantile(kConfidence, freedom) &&
         change.explained / change.explained_freedom <= kMotion * left;
}

/// How long a filter keeps what it began with, where readings of geometry went through one.
double memory_s(const Signals& signals) {
  constexpr double kForgotten = 3.0;  // time constants: a twentieth is left
  std::vector<double> filters;
  for (const Channel channel :
       {Channel::length, Channel::swivel, Channel::roll_pitch, Channel::yaw}) {
    const double filter_s = signals[static_cast<std::size_t>(channel)].correlation_s;
    if (filter_s > 0.0) filters.push_back(filter_s);
  }
  return filters.size() < 2 ? 0.0 : kForgotten * median(filters);
}

}  // namespace

std::optional<SampleRange> unsettled_start(const Log& log, const SampleRange& run,
                                           const Calibration& fitted, double window_s) {
  if (fitted.result.poses.empty()) return std::nullopt;
  const double* const times = log.time_s.data();
  const double* const soon =
      std::lower_bound(times + run.begin, times + run.end, times[run.begin] + 2.0 * window_s);
  SampleRange beginning{run.begin, soon - times};
  if (!fitted.equilibria.empty() && fitted.equilibria.front().samples.begin < beginning.end) {
    beginning.end = fitted.equilibria.front().samples.end;
  }
  const Eigen::Index samples = fitted.problem.measurements.front().samples;
  if (2 * samples >= beginning.size()) return std::nullopt;
  const CalibrationProblem& problem = fitted.problem;
  PoseEvaluation e;
  evaluate_pose(with_effects(problem.robot, problem.effects), problem.measurements.front(),
                fitted.result.poses.front(), StaticsModel::none, {}, problem.effects, true, e);
  if (!e.valid) return std::nullopt;
  const auto later_than = [&](Eigen::Index lead) {
    const SampleRange from{beginning.begin + lead, beginning.end};
    return at_the_start(log, from, fitted.signals, log.time_s[from.begin] - times[run.begin]);
  };
  const Eigen::Index most = (soon - times - beginning.begin) / 4;
  const double* const forgotten =
      std::lower_bound(times + run.begin, soon, times[run.begin] + memory_s(fitted.signals));
  const SampleRange settled_later = later_than(forgotten - times - beginning.begin);
  const auto change_to = [&](Eigen::Index lead, const SampleRange& later) {
    return change_between(log, beginning.begin + lead, later, e, fitted.signals);
  };
  const auto is_off = [&](Eigen::Index lead) {
    constexpr Eigen::Index kMany = 2 * kFewestStill;
    if (settled_later.size() >= kFewestStill && beginning.begin + lead < settled_later.begin) {
      return contradicts(change_to(lead, settled_later), true);
    }
    const SampleRange later = later_than(lead + 1);
    return contradicts(change_to(lead, later), later.size() >= kMany);
  };
  Eigen::Index off = 0;  // samples that are
  while (off < most && is_off(off)) ++off;
  if (off == 0) return std::nullopt;
  // What has sunk into the noise in so many samples is gone after as many again. One that stands
  // alone shows nothing.
  Eigen::Index settled = 2 * off;
  const auto stands_alone = [&](Eigen::Index lead) {
    return later_than(lead).size() < kFewestStill ||
           one_is_odd(change_to(lead, later_than(lead + 1)));
  };
  while (settled < 2 * most && stands_alone(settled)) ++settled;
  return later_than(settled < 2 * most ? settled : 2 * off);
}

}  // namespace cdprcal
