#include "cdprcal/calibration/measurements.hpp"

#include <algorithm>

#include "cdprcal/error.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/readings/log_checks.hpp"
#include "cdprcal/readings/odd_readings.hpp"
#include "cdprcal/readings/still.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

std::string seconds(double time_s) {
  return printed(std::abs(time_s) < 1e12 ? "%.3f s" : "%g s", time_s);
}

/// Row of the sample nearest to a time picked by hand; it must be there.
Eigen::Index row_at(const Log& log, const SampleRange& run, double time_s) {
  const double* begin = log.time_s.data() + run.begin;
  const double* end = log.time_s.data() + run.end;
  const double* after = std::lower_bound(begin, end, time_s);
  const double* nearest = after == end ? after - 1 : after;
  if (nearest != begin && std::abs(*(nearest - 1) - time_s) < std::abs(*nearest - time_s))
    --nearest;
  const double spacing =
      run.size() > 1 ? (*(end - 1) - *begin) / static_cast<double>(run.size() - 1) : 0.0;
  if (!(std::abs(*nearest - time_s) <= std::max(spacing, 1e-3))) {
    throw InputError(name_of(log) + ": no sample at " + seconds(time_s) + "; the run lasts from " +
                     seconds(*begin) + " to " + seconds(*(end - 1)) + "; choose a time within");
  }
  return run.begin + (nearest - begin);
}

/// Whether any tension set-point differs from that of the sample before. NaN: not logged.
bool setpoint_changes(const Log& log, Eigen::Index row) {
  const LogMatrix& setpoints = log.tension_setpoint_N;
  for (Eigen::Index c = 0; c < setpoints.cols(); ++c) {
    const double step = std::abs(setpoints(row, c) - setpoints(row - 1, c));
    if (step > 1e-9 * (1.0 + std::abs(setpoints(row, c)))) return true;
  }
  return false;
}

/// Longest part of a rest over which no tension set-point changes.
SampleRange longest_hold(const Log& log, const SampleRange& rest) {
  SampleRange longest{rest.begin, rest.begin}, now = longest;
  for (Eigen::Index row = rest.begin; row < rest.end; ++row) {
    if (row > rest.begin && setpoint_changes(log, row)) now.begin = row;
    now.end = row + 1;
    if (now.size() > longest.size()) longest = now;
  }
  return longest;
}

/// Whether cables creep so slowly that forces balance all the same: encoders may show hundredths of
/// a millimetre of it, which single samples call a motion.
bool creeps(const Log& log, const SampleRange& beginning, double gravity_m_s2) {
  constexpr double kNegligible = 0.001;  // of the weight
  if (log.length_m.cols() == 0) return false;
  const double time_s = log.time_s[beginning.end - 1] - log.time_s[beginning.begin];
  const double change_m = (log.length_m.row(beginning.end - 1) - log.length_m.row(beginning.begin))
                              .cwiseAbs()
                              .maxCoeff();
  return change_m < kNegligible * gravity_m_s2 * time_s * time_s;
}

/// The samples that show where the platform was at the first one: up to the end of the first rest,
/// no further than the first change of a set-point (if they are held for half a window at all), and
/// only as long as no mean wanders. Nothing where it moves at once.
std::optional<SampleRange> start(const Log& log, const SampleRange& run, const Equilibrium& rest,
                                 double window_s, const Signals& signals, double gravity_m_s2) {
  SampleRange out{run.begin, rest.samples.end};
  Eigen::Index hold = run.begin + 1;
  while (hold < out.end && !setpoint_changes(log, hold)) ++hold;
  if (log.time_s[hold - 1] - log.time_s[run.begin] >= 0.5 * window_s) out.end = hold;
  const SampleRange still = at_the_start(log, out, signals);
  const SampleRange few{out.begin, std::min(out.end, out.begin + kFewestStill)};
  if (still.size() >= few.size()) return still;
  return creeps(log, few, gravity_m_s2) ? std::optional(few) : std::nullopt;
}

/// The samples of a rest that are averaged: its inner part. Where set-points are logged and held
/// for half of the rest or for half a window, that part counts: while they change nothing rests.
SampleRange core(const Log& log, const SampleRange& run, const Equilibrium& rest, double window_s) {
  if (log.tension_setpoint_N.cols() > 0) {
    const SampleRange hold = longest_hold(log, rest.samples);
    const double held_s = log.time_s[hold.end - 1] - log.time_s[hold.begin];
    if (2 * hold.size() >= rest.samples.size() || held_s >= 0.5 * window_s) return hold;
  }
  return inner_part(log, run, rest, window_s);
}

/// Whether the run began in this, its first rest. A test of many windows fails one now and then: a
/// rest found within two windows of the start holds the first sample too, unless a set-point
/// changed before it or the readings wandered.
bool holds_the_start(const Log& log, const SampleRange& run, const Equilibrium& rest,
                     double window_s, const Signals& signals) {
  if (rest.samples.begin == run.begin) return true;
  if (rest.begin_s - log.time_s[run.begin] > 2.0 * window_s) return false;
  const SampleRange until{run.begin, rest.samples.begin + 1};
  if (longest_hold(log, until).size() != until.size()) return false;
  // As much of the rest again, where it is that long: a motion before it would show against that.
  const SampleRange around{run.begin, std::min(rest.samples.end, run.begin + 2 * until.size())};
  return still_since_start(log, around, signals).end >= until.end;
}

}  // namespace

void measure_by_hand(const Log& log, const PathState& path, const SampleRange& run,
                     const CalibrateOptions& options, Calibration& out) {
  const PoseKind kind =
      options.method == Method::kinematic ? PoseKind::kinematic_pose : PoseKind::static_pose;
  std::vector<Eigen::Index> rows;
  for (const double time_s : options.at_s) {
    const Eigen::Index row = row_at(log, run, time_s);
    if (std::find(rows.begin(), rows.end(), row) != rows.end()) {
      throw InputError("at: " + seconds(time_s) +
                       " names a sample that is named already; leave it out");
    }
    rows.push_back(row);
    out.problem.measurements.push_back(
        measurement_at(log, row, kind, out.problem.robot.cable_count()));
    add_path(path, log, {row, row + 1}, log.time_s[run.begin], out.problem.measurements.back());
  }
}

void measure_automatically(const Log& log, const PathState& path, const SampleRange& run,
                           const CalibrateOptions& options, const std::optional<SampleRange>& given,
                           Calibration& out) {
  const Robot& robot = out.problem.robot;
  const int n = robot.cable_count();
  auto& measurements = out.problem.measurements;
  std::vector<char> used(static_cast<std::size_t>(run.size()), 0);
  const auto mark = [&](const SampleRange& samples) {
    std::fill(used.begin() + (samples.begin - run.begin), used.begin() + (samples.end - run.begin),
              1);
  };
  const double window_s = options.detection.window_s;
  bool starts_at_rest = false;
  for (const Equilibrium& rest : out.equilibria) {
    SampleRange samples = core(log, run, rest, window_s);
    const bool given_here = given && given->begin < rest.samples.end;
    if (measurements.empty() &&
        (given_here || holds_the_start(log, run, rest, window_s, out.signals))) {
      const std::optional<SampleRange> first =
          !given_here ? start(log, run, rest, window_s, out.signals, robot.gravity_m_s2)
          : given->size() >= kFewestStill ? given
                                          : std::nullopt;
      starts_at_rest = first.has_value();
      if (starts_at_rest) samples = *first;
    }
    measurements.push_back(measurement_mean(log, samples, PoseKind::static_pose, n));
    add_path(path, log, samples, log.time_s[run.begin], measurements.back());
    mark({measurements.size() == 1 && starts_at_rest ? run.begin : rest.samples.begin,
          rest.samples.end});
  }
  if (!starts_at_rest) {
    const SampleRange samples = given.value_or(SampleRange{run.begin, run.begin + 1});
    measurements.insert(measurements.begin(),
                        measurement_mean(log, samples, PoseKind::kinematic_pose, n));
    add_path(path, log, samples, log.time_s[run.begin], measurements.front());
    mark({run.begin, samples.end});
  }
  measurements.front().time_s = log.time_s[run.begin];  // the reference is the first sample
  if (options.method == Method::statics) return;

  const double lever_m = characteristic_length_m(robot);
  double last = log.time_s[run.begin];
  std::vector<Measurement> moving;
  for (Eigen::Index row = run.begin; row < run.end; ++row) {
    if (used[static_cast<std::size_t>(row - run.begin)]) continue;
    if (log.time_s[row] - last < options.kinematic_spacing_s - 1e-9) continue;
    last = log.time_s[row];
    Measurement m = measurement_at(log, row, PoseKind::kinematic_pose, n);
    leave_out_impossible(log, row, robot.gravity_m_s2, lever_m, m);
    if (spare_readings(m, freedoms(robot)) < 1) continue;  // it would only add unknowns
    moving.push_back(std::move(m));
    add_path(path, log, {row, row + 1}, log.time_s[run.begin], moving.back());
  }
  const auto by_time = [](const Measurement& a, const Measurement& b) {
    return a.time_s < b.time_s;
  };
  measurements.insert(measurements.end(), moving.begin(), moving.end());
  std::stable_sort(measurements.begin() + 1, measurements.end(), by_time);
}

}  // namespace cdprcal
