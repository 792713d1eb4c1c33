#include "cdprcal/startup/watchdog.hpp"

#include <algorithm>

#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

std::string cable_name(int i) { return "cable " + std::to_string(i + 1); }

std::string newtons(double value) { return printed("%.1f N", value); }

bool all_there(const CableVector& values, int n) {
  return values.size() == n && values.allFinite();
}

}  // namespace

double Watchdog::Timer::held(bool condition, double now_s) {
  if (!condition) {
    since_s_ = kNaN;
    return 0.0;
  }
  if (std::isnan(since_s_)) since_s_ = now_s;
  return now_s - since_s_;
}

double WatchdogOptions::slack_N(const Robot& robot) const {
  // A robot whose lower limit is 0 still needs to know slack cables: a hundredth of its weight.
  return robot.tension_min_N > 0.0 ? slack_share * robot.tension_min_N : 0.01 * robot.weight_N();
}

Watchdog::Watchdog(const Robot& robot, const WatchdogOptions& options)
    : options_(options),
      n_(robot.cable_count()),
      slack_N_(options.slack_N(robot)),
      overload_N_(options.overload_share * robot.tension_max_N),
      floor_N_(0.05 * robot.weight_N()),
      had_swivel_(CableVector::Zero(robot.cable_count())) {
  const auto n = static_cast<std::size_t>(n_);
  slack_.resize(n);
  overload_.resize(n);
  off_.resize(n);
  swivel_missing_.resize(n);
  tension_.resize(n);
  length_.resize(n);
  length_then_m_ = CableVector::Constant(n_, kNaN);
  commanded_m_ = CableVector::Zero(n_);
}

bool Watchdog::usable(const RobotSample& sample) const {
  return all_there(sample.length_m, n_) && all_there(sample.tension_N, n_);
}

void Watchdog::raise(const std::string& reason, bool of_winches) {
  if (!reason_.empty()) return;
  reason_ = reason;
  doubts_winches_ = of_winches;
}

const std::string& Watchdog::check(const RobotSample& sample, const CableVector& setpoint_N,
                                   const CableVector& velocity_m_s) {
  if (!reason_.empty()) return reason_;
  if (sample.stop_requested) raise("stopped by the operator", false);
  if (!sample.host_error.empty()) raise(sample.host_error, false);
  if (!sample.drive_error.empty()) raise("drive error: " + sample.drive_error);
  if (!std::isfinite(sample.time_s) || sample.time_s < last_s_) {
    raise("the clock of the samples does not run forward");
    return reason_;
  }
  const double dt_s = std::isnan(last_s_) ? 0.0 : sample.time_s - last_s_;
  last_s_ = sample.time_s;
  check_arrival(sample);
  if (!usable(sample)) return reason_;
  check_tensions(sample, setpoint_N);
  check_stuck(sample);
  check_encoders(sample, velocity_m_s, dt_s);
  return reason_;
}

void Watchdog::check_arrival(const RobotSample& sample) {
  const double now_s = sample.time_s;
  const auto fresh = [&](double arrived_s, double limit_s) {
    return std::isnan(arrived_s) || now_s - arrived_s <= limit_s;
  };
  if (!fresh(sample.drives_time_s, options_.stale_s)) {
    raise("the drives' readings are stale");
  }
  const bool missing = !usable(sample);
  if (missing_.held(missing, now_s) > options_.stale_s) {
    for (int i = 0; i < n_; ++i) {
      if (sample.tension_N.size() != n_ || !std::isfinite(sample.tension_N[i])) {
        raise(cable_name(i) + ": the load cell does not answer");
      } else if (sample.length_m.size() != n_ || !std::isfinite(sample.length_m[i])) {
        raise(cable_name(i) + ": the winch encoder does not answer");
      }
    }
  }
  const bool swivels = sample.swivel_rad.size() == n_;
  for (int i = 0; i < n_; ++i) {
    const bool there = swivels && std::isfinite(sample.swivel_rad[i]);
    if (there) had_swivel_[i] = 1.0;
    if (swivel_missing_[static_cast<std::size_t>(i)].held(had_swivel_[i] > 0.0 && !there, now_s) >
        options_.stale_s) {
      raise(cable_name(i) + ": the swivel encoder does not answer", false);
    }
  }
  // A sensor that was never there is no fault; one that stops is.
  const bool attitude = sample.roll_pitch_yaw_rad.allFinite();
  had_attitude_ = had_attitude_ || attitude;
  if (attitude_missing_.held(had_attitude_ && !attitude, now_s) > options_.attitude_stale_s) {
    raise("the AHRS does not answer", false);
  }
  if (had_attitude_ && !fresh(sample.attitude_time_s, options_.attitude_stale_s)) {
    raise("the AHRS readings are stale", false);
  }
}

void Watchdog::check_tensions(const RobotSample& sample, const CableVector& setpoint_N) {
  const double now_s = sample.time_s;
  for (int i = 0; i < n_; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double tension = sample.tension_N[i];
    if (overload_[k].held(tension > overload_N_, now_s) > options_.tension_s) {
      raise(cable_name(i) + ": over-tension, " + newtons(tension));
    }
    if (setpoint_N.size() != n_) continue;
    if (slack_[k].held(tension < slack_N_, now_s) > options_.tension_s) {
      raise(cable_name(i) + ": slack, " + newtons(tension));
    }
    const double off = std::abs(tension - setpoint_N[i]);
    const double allowed = std::max(options_.follow_share * setpoint_N[i], floor_N_);
    if (off_[k].held(off > allowed, now_s) > options_.follow_s) {
      raise(cable_name(i) + ": the tension does not follow its set-point, " + newtons(tension) +
            " instead of " + newtons(setpoint_N[i]));
    }
  }
}

bool Watchdog::flickers(Flicker& f, double value, double now_s) const {
  if (!(value == f.value)) {
    // Only pauses between changes count as normal: the wait for the first is of unknown length.
    if (f.changes > 0) f.longest_s = std::max(f.longest_s, now_s - f.since_s);
    f.value = value;
    f.since_s = now_s;
    ++f.changes;
    return true;
  }
  // Stuck: it changed at least kKnown times, and now stands still for stuck_s, and ten times longer
  // than ever before.
  constexpr int kKnown = 20;
  return f.changes < kKnown || now_s - f.since_s <= std::max(options_.stuck_s, 10.0 * f.longest_s);
}

void Watchdog::check_stuck(const RobotSample& sample) {
  const double now_s = sample.time_s;
  for (int i = 0; i < n_; ++i) {
    if (!flickers(tension_[static_cast<std::size_t>(i)], sample.tension_N[i], now_s)) {
      raise(cable_name(i) + ": the load cell is stuck");
    }
    if (!flickers(length_[static_cast<std::size_t>(i)], sample.length_m[i], now_s)) {
      raise(cable_name(i) + ": the winch encoder is stuck");
    }
  }
  if (sample.roll_pitch_yaw_rad.allFinite() &&
      !flickers(attitude_, sample.roll_pitch_yaw_rad.sum(), now_s)) {
    raise("the AHRS is stuck", false);
  }
}

void Watchdog::check_encoders(const RobotSample& sample, const CableVector& velocity_m_s,
                              double dt_s) {
  for (int i = 0; i < n_; ++i) {
    if (velocity_m_s.size() == n_) commanded_m_[i] += velocity_m_s[i] * dt_s;
    // Path commanded since the encoder last changed.
    if (!(sample.length_m[i] == length_then_m_[i])) {
      length_then_m_[i] = sample.length_m[i];
      commanded_m_[i] = 0.0;
    } else if (std::abs(commanded_m_[i]) > options_.runaway_m) {
      raise(cable_name(i) + ": the winch was told to move and its encoder did not");
    }
  }
}

}  // namespace cdprcal
