#include "cdprcal/diagnosis/events.hpp"

#include <algorithm>

#include "cdprcal/effects/applied.hpp"
#include "cdprcal/readings/equilibrium_detection.hpp"
#include "cdprcal/readings/fresh.hpp"
#include "cdprcal/readings/outliers.hpp"
#include "cdprcal/readings/rest_list.hpp"
#include "cdprcal/readings/signal.hpp"
#include "cdprcal/statics/taut.hpp"
#include "cdprcal/statistics.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

/// Whether any other reading jerks around a row by more than noise does: its second difference
/// there against its noise, at a chance of a thousandth over all that is looked at.
bool platform_jerks(const Log& log, const SampleRange& run, Eigen::Index row,
                    Eigen::Index tension_column) {
  constexpr Eigen::Index kBefore = 1, kAfter = 4;
  constexpr double kChance = 1e-3;
  const Eigen::Index begin = row - kBefore;  // no outlier is at the ends of a run (departures)
  const Eigen::Index end = std::min(run.end, row + kAfter + 1);
  const auto looked_at = static_cast<double>(
      (end - begin) * (log.length_m.cols() + log.swivel_rad.cols() + log.tension_N.cols() + 3));
  const double limit = normal_quantile(1.0 - 0.5 * kChance / std::max(1.0, looked_at));
  const auto any = [&](const LogMatrix& readings, bool angles, Eigen::Index but) {
    const FreshRows fresh = fresh_rows(readings, run);
    for (Eigen::Index c = 0; c < readings.cols(); ++c) {
      if (c == but) continue;
      const double noise = channel_noise(readings.col(c)(fresh.rows), angles);
      for (Eigen::Index i = begin; i < end; ++i) {
        double d1 = readings(i, c) - readings(i - 1, c);
        double d0 = readings(i - 1, c) - readings(i - 2, c);
        if (angles) d1 = wrap_angle(d1), d0 = wrap_angle(d0);
        if (std::abs(d1 - d0) > limit * std::sqrt(6.0) * noise) return true;
      }
    }
    return false;
  };
  return any(log.length_m, false, -1) || any(log.swivel_rad, true, -1) ||
         any(log.roll_pitch_yaw_rad, true, -1) || any(log.tension_N, false, tension_column);
}

/// Outliers of tension that are cables gone slack between two samples, by name. `before`: the log
/// before outliers were taken out of it, without what its load cells are known to add.
void name_short_slack(const Log& before, const SampleRange& run, std::vector<LogEvent>& events) {
  constexpr double kZero = 4.0;  ///< σ of noise within which a reading is zero
  for (LogEvent& event : events) {
    if (event.name != "outlier" || event.channel != "tension") continue;
    const double* times = before.time_s.data();
    const Eigen::Index row =
        std::lower_bound(times, times + before.time_s.size(), event.begin_s) - times;
    const auto tension = before.tension_N.col(event.cable);
    const double noise = channel_noise(tension(fresh_rows(before.tension_N, run).rows));
    if (std::abs(tension[row]) > kZero * noise) continue;
    if (!platform_jerks(before, run, row, event.cable)) continue;
    event.name = "slack";
    event.size = tension[row];
  }
}

/// Readings of a cable below what is taut, one after the other.
struct Low {
  LogEvent event;
  double mean_N = 0.0, sigma_N = 0.0;  ///< and that of its noise
};

/// `tension_N`: what the cables carry, NaN where a reading was taken out of the log. `rows`: the
/// fresh readings, and the end of the run. One reading alone: name_short_slack.
std::vector<Low> low_tensions(double taut_N, const Log& log, const LogMatrix& tension_N,
                              const std::vector<Eigen::Index>& rows) {
  std::vector<Low> out;
  const std::size_t count = rows.size() - 1;
  const std::vector<Eigen::Index> fresh(rows.begin(), rows.end() - 1);
  for (Eigen::Index c = 0; c < tension_N.cols(); ++c) {
    const double noise_N = channel_noise(log.tension_N.col(c)(fresh));
    for (std::size_t i = 0; i < count; ++i) {
      std::size_t end = i;
      double sum_N = 0.0, least_N = taut_N;
      for (; end < count && tension_N(rows[end], c) < taut_N; ++end) {
        sum_N += tension_N(rows[end], c);
        least_N = std::min(least_N, tension_N(rows[end], c));
      }
      const auto readings = static_cast<double>(end - i);
      if (readings > 1.0) {
        out.push_back({{"slack", log.time_s[rows[i]], log.time_s[rows[end] - 1],
                        static_cast<int>(c), "tension", least_N},
                       sum_N / readings,
                       noise_N / std::sqrt(readings)});
      }
      i = std::max(i, end);
    }
  }
  return out;
}

/// Where a cable would push, load cells are off by more than their noise, and by no more than the
/// robot file says.
void find_slack(const Robot& robot, const std::vector<Low>& lows, std::vector<LogEvent>& out) {
  const double taut_N = taut_tension_N(robot);
  const bool any_pushes = std::ranges::any_of(
      lows, [&](const Low& low) { return low.mean_N < pushing_below_N(robot, low.sigma_N); });
  const double doubted_N = slack_level_N(robot, robot.sigma.tension_N);
  for (const Low& low : lows) {
    const double level_N = any_pushes ? doubted_N : taut_N - kSlackDoubt * low.sigma_N;
    if (low.mean_N < level_N) out.push_back(low.event);
  }
}

/// Whether a channel scatters within a range as its noise does, by a χ² test that a clean log of
/// thousands of windows passes.
bool quiet(const Eigen::VectorXd& values, const SampleRange& range, const Signal& signal,
           bool angles) {
  constexpr double kConfidence = 1.0 - 1e-7;
  double count = 0.0, sum = 0.0, squares = 0.0;
  for (Eigen::Index i = range.begin; i < range.end; ++i) {
    double d = values[i] - values[range.begin];
    if (!std::isfinite(d)) continue;
    if (angles) d = wrap_angle(d);
    count += 1.0, sum += d, squares += d * d;
  }
  const double independent = signal.effective(count);
  if (independent < 3.0 || !(signal.sigma > 0.0)) return true;
  const double scatter = (squares - sum * sum / count) * independent / count;
  const double limit = chi_square_quantile(kConfidence, independent - 1.0);
  return scatter <= 2.0 * signal.sigma * signal.sigma * limit;
}

/// Whether set-points are logged and none of them changes over these rows.
bool same_setpoint(const Log& log, const SampleRange& rows) {
  const LogMatrix& setpoint = log.tension_setpoint_N;
  if (setpoint.cols() == 0) return false;
  const auto held = setpoint.middleRows(rows.begin, rows.size());
  return held.allFinite() && (held.rowwise() - held.row(0)).cwiseAbs().maxCoeff() <= 1e-9;
}

/// A rest joins quiet spells at one place when the time between them is short: a swing was there.
void find_oscillations(const Robot& robot, const Log& log, const SampleRange& run,
                       std::vector<LogEvent>& out) {
  constexpr double kWindow_s = 1.0;
  struct Column {
    Eigen::VectorXd values;
    Signal signal;
    bool angles;
  };
  if (log.length_m.cols() + log.swivel_rad.cols() + log.roll_pitch_yaw_rad.cols() == 0) return;
  const std::vector<Equilibrium> rests = detect_equilibria(log, run, robot.sigma);
  const Signals how = signals(log, run, rests, robot.sigma);
  std::vector<Column> columns;
  for (const Channel channel :
       {Channel::length, Channel::swivel, Channel::roll_pitch, Channel::yaw}) {
    const ChannelRow& row = row_of(channel);
    const LogMatrix& readings = *log.groups()[static_cast<std::size_t>(row.sensor)];
    const bool angles = row.of().is_angle();
    const Eigen::Index beyond = std::min<Eigen::Index>(row.first + row.count, readings.cols());
    for (Eigen::Index c = row.first; c < beyond; ++c) {
      const Eigen::VectorXd values = readings.col(c);
      const double noise = channel_noise(values.segment(run.begin, run.size()), angles);
      columns.push_back({values, of_column(how[static_cast<std::size_t>(channel)], noise), angles});
    }
  }
  for (std::size_t i = 0; i + 1 < rests.size(); ++i) {
    const Equilibrium &a = rests[i], &b = rests[i + 1];
    if (same_setpoint(log, {a.samples.end - 1, b.samples.begin + 1})) {
      out.push_back({"oscillation", a.end_s, b.begin_s, -1, "", 0.0});
    }
  }
  for (const Equilibrium& rest : rests) {
    LogEvent event{"oscillation", kNaN, kNaN, -1, "", 0.0};
    Eigen::Index end = rest.samples.begin;
    for (Eigen::Index begin = rest.samples.begin; begin < rest.samples.end; ++begin) {
      while (end < rest.samples.end && log.time_s[end] - log.time_s[begin] < kWindow_s) ++end;
      if (end >= rest.samples.end) break;
      const bool at_rest = std::all_of(columns.begin(), columns.end(), [&](const Column& c) {
        return quiet(c.values, {begin, end}, c.signal, c.angles);
      });
      if (at_rest) continue;
      if (!std::isfinite(event.begin_s)) event.begin_s = log.time_s[begin];
      event.end_s = log.time_s[end];
    }
    // At its ends a rest passes into motion.
    const bool within =
        event.begin_s > rest.begin_s + kWindow_s && event.end_s < rest.end_s - kWindow_s;
    if (within) out.push_back(event);
  }
}

}  // namespace

std::string describe(const LogEvent& event) {
  if (event.name == "slack") {
    if (event.channel == "tension" && event.end_s == event.begin_s) {
      return printed(
          "slack at %.2f s for less than two samples, cable %d (%.1f N, and the platform "
          "jerks): left out",
          event.begin_s, event.cable + 1, event.size);
    }
    return printed("slack from %.2f to %.2f s, cable %d (down to %.1f N): its balance is left out",
                   event.begin_s, event.end_s, event.cable + 1, event.size);
  }
  if (event.name == "oscillation") {
    return printed("oscillation from %.2f to %.2f s at one set-point", event.begin_s, event.end_s);
  }
  const std::string whose = event.cable >= 0 ? printed(" of cable %d", event.cable + 1) : "";
  return printed("outlier at %.2f s, %s%s (%+.4g): left out", event.begin_s, event.channel.c_str(),
                 whose.c_str(), event.size);
}

std::vector<LogEvent> gate_events(const Robot& robot, Log& log) {
  std::vector<LogEvent> out;
  if (is_rest_list(log)) return out;  // no reading has a neighbour to stand out from
  const SampleRange run = segments(log).back();
  const Log before = with_known_effects(robot, log).log;
  for (const Outlier& outlier : leave_out_outliers(robot.sigma, run, log)) {
    const Sensor& sensor = row_of(outlier.channel).of();
    const bool of_cable = sensor.width == kOneACable;
    const auto column = static_cast<std::size_t>(outlier.column);
    out.push_back({"outlier", outlier.begin_s, outlier.end_s, of_cable ? outlier.column : -1,
                   sensor.width == 3 ? sensor.columns[column] : sensor.name, outlier.off});
  }
  name_short_slack(before, run, out);
  const LogMatrix carried_N = log.tension_N.array().isNaN().select(kNaN, before.tension_N);
  std::vector<Eigen::Index> fresh = fresh_rows(log.tension_N, run).rows;
  fresh.push_back(run.end);
  find_slack(robot, low_tensions(taut_tension_N(robot), log, carried_N, fresh), out);
  find_oscillations(robot, log, run, out);
  std::stable_sort(out.begin(), out.end(),
                   [](const LogEvent& a, const LogEvent& b) { return a.begin_s < b.begin_s; });
  return out;
}

}  // namespace cdprcal
