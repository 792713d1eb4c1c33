#include "cdprcal/readings/path_state.hpp"

#include <algorithm>

#include "cdprcal/readings/equilibrium_detection.hpp"
#include "cdprcal/readings/fresh.hpp"
#include "cdprcal/readings/lengths.hpp"
#include "cdprcal/readings/turn_over.hpp"

namespace cdprcal {
namespace {

/// Dead bands in σ of the smoothed noise.
constexpr double kNarrow = 1.0, kWide = 3.0;
/// Half the window of a rate: short against the swings of robots of a few metres (2 to 5 rad/s),
/// long enough that the noise of a rate stays well below the rates of a transition.
constexpr double kSlope_s = 0.3;

/// Mean over ±half window around each sample, within a segment, angles unwrapped.
Eigen::VectorXd smoothed(const Eigen::VectorXd& time, Eigen::VectorXd values,
                         const SampleRange& range, double window_s, bool angles) {
  if (angles) {
    auto own = values.segment(range.begin, range.size());
    own = unwrapped(own);
  }
  Eigen::VectorXd out = values;
  Eigen::Index begin = range.begin, end = range.begin;
  double sum = 0.0;
  int count = 0;
  for (Eigen::Index i = range.begin; i < range.end; ++i) {
    while (end < range.end && time[end] <= time[i] + 0.5 * window_s + 1e-9) {
      if (std::isfinite(values[end])) sum += values[end], ++count;
      ++end;
    }
    while (time[begin] < time[i] - 0.5 * window_s - 1e-9) {
      if (std::isfinite(values[begin])) sum -= values[begin], --count;
      ++begin;
    }
    out[i] = count > 0 ? sum / count : kNaN;
  }
  return out;
}

/// Play operator of half-width `half`: the state follows the motion and saturates at ±1. Motion
/// counts from ± `noise` on, so that noise does not change the state. `direction`: the middle of
/// where it may be, `open`: half of that range.
void follow(const Eigen::VectorXd& values, const SampleRange& range, double half, double noise,
            Eigen::Ref<Eigen::VectorXd> direction, Eigen::Ref<Eigen::VectorXd> open) {
  double least = -1.0, most = 1.0, reached = kNaN;
  for (Eigen::Index i = range.begin; i < range.end; ++i) {
    if (std::isfinite(values[i])) {
      if (!std::isfinite(reached)) reached = values[i];
      const double moved_to = std::clamp(reached, values[i] - noise, values[i] + noise);
      least = turned_over(least, moved_to - reached, 2.0 * half);
      most = turned_over(most, moved_to - reached, 2.0 * half);
      reached = moved_to;
    }
    direction[i] = 0.5 * (least + most);
    open[i] = 0.5 * (most - least);
  }
}

/// s as the mean of that with a narrow and a wide dead band, and half their difference.
void directions(const Log& log, const LogMatrix& values, double turn_over, double window_s,
                bool angles, LogMatrix& mean, LogMatrix& error, LogMatrix& open) {
  mean = error = open = LogMatrix::Zero(values.rows(), values.cols());
  for (const SampleRange& range : segments(log)) {
    const double rate = range.size() > 1 ? static_cast<double>(range.size() - 1) /
                                               (log.time_s[range.end - 1] - log.time_s[range.begin])
                                         : 1.0;
    const FreshRows fresh = fresh_rows(values, range);
    const double averaged = std::max(1.0, window_s * rate / fresh.hold_rows);
    for (Eigen::Index c = 0; c < values.cols(); ++c) {
      const Eigen::VectorXd column = values.col(c);
      const double noise = channel_noise(column(fresh.rows), angles) / std::sqrt(averaged);
      const Eigen::VectorXd smooth = smoothed(log.time_s, column, range, window_s, angles);
      Eigen::VectorXd narrow = Eigen::VectorXd::Zero(values.rows()), wide = narrow;
      Eigen::VectorXd narrow_open = narrow, wide_open = narrow;
      follow(smooth, range, 0.5 * turn_over, kNarrow * noise, narrow, narrow_open);
      follow(smooth, range, 0.5 * turn_over, kWide * noise, wide, wide_open);
      const auto own = [&](const Eigen::VectorXd& all) {
        return all.segment(range.begin, range.size());
      };
      mean.col(c).segment(range.begin, range.size()) = 0.5 * (own(narrow) + own(wide));
      error.col(c).segment(range.begin, range.size()) = 0.5 * (own(narrow) - own(wide));
      open.col(c).segment(range.begin, range.size()) = 0.5 * (own(narrow_open) + own(wide_open));
    }
  }
}

/// Slopes of straight lines through the readings around each sample of a segment.
LogMatrix slopes(const Log& log, const LogMatrix& values, bool angles) {
  LogMatrix out = LogMatrix::Zero(values.rows(), values.cols());
  const Eigen::VectorXd& time = log.time_s;
  for (const SampleRange& range : segments(log)) {
    for (Eigen::Index c = 0; c < values.cols(); ++c) {
      const Eigen::VectorXd column = values.col(c);
      Eigen::Index begin = range.begin, end = range.begin;
      for (Eigen::Index i = range.begin; i < range.end; ++i) {
        while (end < range.end && time[end] <= time[i] + kSlope_s + 1e-9) ++end;
        while (time[begin] < time[i] - kSlope_s - 1e-9) ++begin;
        if (!std::isfinite(column[i])) continue;
        double count = 0.0, t = 0.0, y = 0.0, tt = 0.0, ty = 0.0;
        for (Eigen::Index j = begin; j < end; ++j) {
          if (!std::isfinite(column[j])) continue;
          const double apart = column[j] - column[i], dy = angles ? wrap_angle(apart) : apart;
          const double dt = time[j] - time[i];
          count += 1.0, t += dt, y += dy, tt += dt * dt, ty += dt * dy;
        }
        const double spread = tt - t * t / std::max(count, 1.0);
        if (count >= 3.0 && spread > 0.0) out(i, c) = (ty - t * y / count) / spread;
      }
    }
  }
  return out;
}

}  // namespace

PathState path_state(const Robot& robot, const Log& log, double smoothing_s) {
  PathState state;
  // Whole lengths turn over as changes of length do.
  const LogMatrix none(log.length_m.rows(), 0), *lengths = read_lengths(log);
  directions(log, lengths != nullptr ? *lengths : none, turn_over_m(robot), smoothing_s, false,
             state.length_direction, state.length_direction_error, state.length_direction_open);
  directions(log, log.swivel_rad, kTurnOver_rad, smoothing_s, true, state.swivel_direction,
             state.swivel_direction_error, state.swivel_direction_open);
  state.length_rate_m_s = slopes(log, lengths != nullptr ? *lengths : none, false);
  state.swivel_rate_rad_s = slopes(log, log.swivel_rad, true);
  state.attitude_rate_rad_s = slopes(log, log.roll_pitch_yaw_rad, true);
  return state;
}

}  // namespace cdprcal
