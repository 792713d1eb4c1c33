#include "cdprcal/acquisition/path_state.hpp"

#include <algorithm>

#include "cdprcal/acquisition/equilibrium_detection.hpp"

namespace cdprcal {
namespace {

constexpr double kTurnOver_m = 1e-3;
constexpr double kTurnOver_rad = 0.5 * kDegree;

/// Mean over ±half window around each sample, within a segment, angles unwrapped.
Eigen::VectorXd smoothed(const Eigen::VectorXd& time, Eigen::VectorXd values,
                         const SampleRange& range, double window_s, bool angles) {
  if (angles) {
    double previous = kNaN;
    for (Eigen::Index i = range.begin; i < range.end; ++i) {
      if (!std::isfinite(values[i])) continue;
      if (std::isfinite(previous)) values[i] = previous + wrap_angle(values[i] - previous);
      previous = values[i];
    }
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

/// Play operator of half-width `half`: the state follows the motion and saturates at ±1. Motion is
/// what leaves a dead band of ± `noise` around where it last was, so that noise turns nothing over.
void follow(const Eigen::VectorXd& values, const SampleRange& range, double half, double noise,
            Eigen::Ref<Eigen::VectorXd> direction) {
  double state = 0.0, reached = kNaN;
  for (Eigen::Index i = range.begin; i < range.end; ++i) {
    if (std::isfinite(values[i])) {
      if (!std::isfinite(reached)) reached = values[i];
      const double moved_to = std::clamp(reached, values[i] - noise, values[i] + noise);
      state = std::clamp(state + (moved_to - reached) / half, -1.0, 1.0);
      reached = moved_to;
    }
    direction[i] = state;
  }
}

LogMatrix directions(const Log& log, const LogMatrix& values, double turn_over, double window_s,
                     bool angles) {
  LogMatrix out = LogMatrix::Zero(values.rows(), values.cols());
  for (const SampleRange& range : segments(log)) {
    const double rate = range.size() > 1 ? static_cast<double>(range.size() - 1) /
                                               (log.time_s[range.end - 1] - log.time_s[range.begin])
                                         : 1.0;
    const double averaged = std::max(1.0, window_s * rate);
    for (Eigen::Index c = 0; c < values.cols(); ++c) {
      const Eigen::VectorXd column = values.col(c);
      const double noise = channel_noise(column.segment(range.begin, range.size()));
      Eigen::VectorXd direction = Eigen::VectorXd::Zero(values.rows());
      follow(smoothed(log.time_s, column, range, window_s, angles), range, 0.5 * turn_over,
             3.0 * noise / std::sqrt(averaged), direction);
      out.col(c).segment(range.begin, range.size()) = direction.segment(range.begin, range.size());
    }
  }
  return out;
}

}  // namespace

PathState path_state(const Log& log, double smoothing_s) {
  PathState state;
  state.length_direction = directions(log, log.length_m, kTurnOver_m, smoothing_s, false);
  state.swivel_direction = directions(log, log.swivel_rad, kTurnOver_rad, smoothing_s, true);
  state.attitude_rate_rad_s =
      LogMatrix::Zero(log.roll_pitch_yaw_rad.rows(), log.roll_pitch_yaw_rad.cols());
  // Central differences of the reading itself, over three samples: short against any swing.
  for (const SampleRange& range : segments(log)) {
    for (Eigen::Index i = range.begin + 1; i + 1 < range.end; ++i) {
      for (Eigen::Index c = 0; c < log.roll_pitch_yaw_rad.cols(); ++c) {
        const double change = log.roll_pitch_yaw_rad(i + 1, c) - log.roll_pitch_yaw_rad(i - 1, c);
        if (std::isfinite(change)) {
          state.attitude_rate_rad_s(i, c) =
              wrap_angle(change) / (log.time_s[i + 1] - log.time_s[i - 1]);
        }
      }
    }
  }
  return state;
}

}  // namespace cdprcal
