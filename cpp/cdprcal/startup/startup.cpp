#include "cdprcal/startup/startup.hpp"

#include <algorithm>
#include <utility>

#include "cdprcal/error.hpp"
#include "cdprcal/geometry/fifth_degree.hpp"
#include "cdprcal/startup/startup_checks.hpp"

namespace cdprcal {

const char* to_string(StartUpState state) {
  switch (state) {
    case StartUpState::idle:
      return "idle";
    case StartUpState::recording:
      return "recording";
    case StartUpState::moving_to_start:
      return "moving_to_start";
    case StartUpState::moving:
      return "moving";
    case StartUpState::settling:
      return "settling";
    case StartUpState::measuring:
      return "measuring";
    case StartUpState::done:
      return "done";
    case StartUpState::holding:
      return "holding";
  }
  return "unknown";
}

StartUp::StartUp(const Robot& robot, StartUpPlan plan, const StartUpOptions& options)
    : robot_(robot),
      plan_(std::move(plan)),
      options_(options),
      velocity_limit_m_s_(options.velocity_limit_m_s > 0.0 ? options.velocity_limit_m_s
                                                           : derived_velocity_m_s(robot)),
      controller_(robot.cable_count(), options.control, velocity_limit_m_s_),
      rest_(robot.cable_count(), robot.sigma, options.rest),
      watchdog_(robot, options.watchdog) {
  check_options(options_);
  check_plan(robot_, plan_);
  transition_s_ = plan_.transition_s;
  if (!plan_.pose.empty()) {
    lengths_.emplace(robot_, options_.control, velocity_limit_m_s_);
    lengths_->reset(plan_.pose.front());
  }
  // Leg 0 starts at tensions nobody knows yet; until then it is the place τ₀.
  std::optional<Pose> at;
  if (led_by_lengths()) at = plan_.pose.front();
  Legs legs = legs_of(plan_, plan_.setpoint_N.front(), at, transition_s_, "");
  leg_ = std::move(legs.by_tension);
  motion_ = std::move(legs.by_length);
  led_by_tension_ = std::move(legs.led_by_tension);
  const int n = robot_.cable_count();
  command_.velocity_m_s.setZero(n);
  along_m_s_.setZero(n);
  command_.by_tension.assign(static_cast<std::size_t>(n), !led_by_lengths());
  command_.tension_setpoint_N = plan_.setpoint_N.front();
  recorded_sum_N_.setZero(n);
  begin_leg();
}

/// No cable governs the tensions well everywhere: each leg has those that do there.
void StartUp::begin_leg() {
  if (!led_by_lengths()) return;
  const auto k = static_cast<std::size_t>(command_.setpoint);
  lengths_->lead(led_by_tension_[k], motion_[k].from);
  const std::vector<bool> before = command_.by_tension;
  command_.by_tension.assign(static_cast<std::size_t>(robot_.cable_count()), false);
  for (const int cable : led_by_tension_[k]) {
    const auto c = static_cast<std::size_t>(cable);
    command_.by_tension[c] = true;
    // Nothing held its tension at the set-point until now.
    if (k > 0 && !before[c]) from_N_[cable] = last_tension_N_[cable];
  }
}

StartUp::Legs StartUp::legs_of(const StartUpPlan& plan, CableVector from_N, std::optional<Pose> at,
                               std::vector<double>& transition_s, const std::string& of) const {
  Legs legs;
  std::vector<int> led;
  if (!led_by_tension_.empty()) {
    led = led_by_tension_[static_cast<std::size_t>(command_.setpoint)];
  } else if (led_by_lengths()) {
    led = cables_led_by_tension(robot_, plan.pose);
  }
  for (std::size_t k = 0; k < plan.setpoint_N.size(); ++k) {
    const CableVector& to_N = plan.setpoint_N[k];
    if (led_by_lengths()) {
      const HeldMotion& motion = legs.by_length.emplace_back(*at, from_N, plan.pose[k], to_N);
      led = cables_led_by_tension(
          robot_, {motion.from, plus(motion.from, 0.5 * motion.twist), plan.pose[k]}, led);
      legs.led_by_tension.push_back(led);
      at = plan.pose[k];
      // A way that some cables are too slow for is another way than the one that was checked.
      transition_s[k] =
          std::max(transition_s[k],
                   held_transition_time_s(robot_, legs.by_length.back(), velocity_limit_m_s_));
    } else {
      // Without a pose to begin with, the first leg is a place.
      PathResult path = follow_equilibrium(robot_, from_N, to_N, at, at ? 9 : 1);
      if (!path.found) {
        throw InputError("start-up plan: no stable equilibrium on the way to set-point " +
                         std::to_string(k + 1) + of + ": " + path.reason +
                         (of.empty() ? "; make a plan with cdprcal plan" : "; choose another"));
      }
      at = path.leg.nodes.back().pose;
      if (transition_s[k] == 0.0) {
        transition_s[k] = transition_time_s(path.leg, velocity_limit_m_s_);
      }
      legs.by_tension.push_back(std::move(path.leg));
    }
    from_N = to_N;
  }
  return legs;
}

void StartUp::finish() {
  if (command_.state == StartUpState::done || command_.state == StartUpState::holding) return;
  enter(StartUpState::done);
}

void StartUp::go_on_with(const StartUpPlan& rest) {
  if (command_.state == StartUpState::done || command_.state == StartUpState::holding) {
    throw InputError("start-up: the run has ended; start another to add set-points");
  }
  StartUpPlan checked = rest;
  if (!checked.setpoint_N.empty()) {
    check_plan(robot_, checked);
    if (checked.pose.empty() == led_by_lengths()) {
      throw InputError("start-up plan: give the rest poses where the run has them, and else none");
    }
  }
  const auto present = static_cast<std::size_t>(command_.setpoint);
  const Pose at = led_by_lengths() ? plan_.pose[present] : leg_[present].nodes.back().pose;
  const Legs legs =
      legs_of(checked, plan_.setpoint_N[present], at, checked.transition_s, " of the rest");
  const auto replace = [&](auto& all, auto& by) {
    all.resize(std::min(all.size(), present + 1));
    all.insert(all.end(), by.begin(), by.end());
  };
  plan_.via.resize(plan_.setpoint_N.size(), false);
  checked.via.resize(checked.setpoint_N.size(), false);
  replace(plan_.setpoint_N, checked.setpoint_N);
  replace(plan_.via, checked.via);
  replace(plan_.pose, checked.pose);
  replace(transition_s_, checked.transition_s);
  replace(leg_, legs.by_tension);
  replace(motion_, legs.by_length);
  replace(led_by_tension_, legs.led_by_tension);
  plan_.transition_s = transition_s_;
}

void StartUp::enter(StartUpState state) {
  if (state == StartUpState::done || state == StartUpState::holding) {
    calm_s_ = patience_to_stop_s();
  }
  command_.state = state;
  entered_s_ = now_s_;
}

void StartUp::hold(const std::string& reason) {
  command_.reason = reason;
  enter(StartUpState::holding);
}

bool StartUp::finished() const {
  return (command_.state == StartUpState::done || command_.state == StartUpState::holding) &&
         command_.locked;
}

const StartUpCommand& StartUp::step(const RobotSample& sample) {
  using enum StartUpState;
  const double dt_s =
      std::isnan(now_s_) || !(sample.time_s > now_s_) ? 0.0 : sample.time_s - now_s_;
  const bool ended = command_.state == done || command_.state == holding;
  const bool controlling = !ended && command_.state != idle && command_.state != recording;
  if (!ended) {
    const std::string& fault = watchdog_.check(
        sample, controlling ? watched_setpoint_N() : CableVector(), command_.velocity_m_s);
    if (std::isfinite(sample.time_s)) now_s_ = sample.time_s;
    if (!fault.empty()) hold(fault);
  } else if (std::isfinite(sample.time_s)) {
    now_s_ = std::max(now_s_, sample.time_s);
  }

  // What this computer stops for may be where the platform goes: it shall go no further.
  if (!sample.host_error.empty()) calm_s_ = std::min(calm_s_, 0.0);

  const bool usable = watchdog_.usable(sample);
  if (usable) usable_s_ = now_s_;
  if (command_.state != holding && command_.state != done && usable) {
    rest_.push(sample);
    last_tension_N_ = sample.tension_N;
  }
  switch (command_.state) {
    case idle:
      enter(recording);
      [[fallthrough]];
    case recording:
      if (usable) record(sample);
      break;
    case moving_to_start:
    case moving:
      move(sample, dt_s);
      break;
    case settling:
    case measuring:
      place_.reset(1.0, 0.0);
      control(sample, dt_s);
      command_.state == settling ? settle() : measure();
      break;
    case done:
    case holding:
      break;
  }
  if (command_.state == done || command_.state == holding) {
    stop(sample, usable, dt_s);
    command_.locked = command_.velocity_m_s.isZero(0.0);
  }
  command_.remaining_s = estimate_remaining_s();
  return command_;
}

void StartUp::stop(const RobotSample& sample, bool usable, double dt_s) {
  // A missing reading for a few samples is no fault here either.
  const bool trusted =
      !watchdog_.doubts_winches() && now_s_ - usable_s_ <= options_.watchdog.stale_s;
  const auto trust_no_load_cell = [&] {
    std::fill(command_.by_tension.begin(), command_.by_tension.end(), false);
  };
  if (watchdog_.doubts_winches()) trust_no_load_cell();
  if (!(dt_s > 0.0)) {  // a ramp needs a clock that runs; without one, stop at once
    command_.velocity_m_s.setZero();
  } else if (lengths_) {
    CableVector error_N = CableVector::Zero(robot_.cable_count());
    if (trusted && usable) error_N = command_.tension_setpoint_N - sample.tension_N;
    command_.velocity_m_s = lengths_->stop(error_N, dt_s);
  } else if (trusted && now_s_ - entered_s_ < calm_s_) {
    calm(sample, dt_s);
  } else {
    // What was commanded answers load cells, and a drive with a tension loop did not run at it.
    if (std::exchange(calm_s_, -1.0) >= 0.0) controller_.reset(along_m_s_);
    trust_no_load_cell();
    command_.velocity_m_s = controller_.stop(dt_s);
  }
}

/// Tensions lead: the set-point comes to rest on its leg, and the platform on it. At last
/// velocities fade out, too.
void StartUp::calm(const RobotSample& sample, double dt_s) {
  const auto k = static_cast<std::size_t>(command_.setpoint);
  place_.slow_down(dt_s);
  command_.tension_setpoint_N = from_N_ + place_.s() * (plan_.setpoint_N[k] - from_N_);
  control(sample, dt_s);
  const double left_s = calm_s_ - (now_s_ - entered_s_);
  command_.velocity_m_s *= std::min(1.0, left_s / kFullSpeed_s);
}

/// How long tensions may lead the platform to a stop: it rests when it is measured.
double StartUp::patience_to_stop_s() const {
  using enum StartUpState;
  constexpr double kAtMost_s = 5.0;
  const bool moves =
      command_.state == moving_to_start || command_.state == moving || command_.state == settling;
  if (lengths_ || !moves) return 0.0;
  const auto k = static_cast<std::size_t>(command_.setpoint);
  return std::min(kAtMost_s, 2.0 * kPi / leg_[k].slowest_rad_s());
}

/// What the tensions must follow: NaN of a cable that is led by its length.
CableVector StartUp::watched_setpoint_N() const {
  CableVector watched_N = command_.tension_setpoint_N;
  for (std::size_t i = 0; i < command_.by_tension.size(); ++i) {
    if (!command_.by_tension[i]) watched_N[static_cast<Eigen::Index>(i)] = kNaN;
  }
  return watched_N;
}

void StartUp::record(const RobotSample& sample) {
  recorded_sum_N_ += sample.tension_N;
  ++recorded_;
  from_N_ = recorded_sum_N_ / recorded_;
  // The set-point while recording is the first reading, brought within the limits. It stays
  // constant until the winches move, so that the log shows when that was.
  const auto within_limits = [this](const CableVector& tension_N) -> CableVector {
    return tension_N.cwiseMax(robot_.tension_min_N).cwiseMin(robot_.tension_max_N);
  };
  if (recorded_ == 1) command_.tension_setpoint_N = within_limits(from_N_);
  if (now_s_ - entered_s_ < options_.record_s - 1e-9) return;
  from_N_ = command_.tension_setpoint_N = within_limits(from_N_);
  plan_first_leg();
  begin_move();
  enter(StartUpState::moving_to_start);
}

void StartUp::plan_first_leg() {
  if (lengths_) {  // the tensions change, the pose stays
    motion_[0] = {plan_.pose.front(), from_N_, plan_.pose.front(), plan_.setpoint_N.front()};
    return;
  }
  // The pose that these tensions would hold is only a guess of the present one (the platform may
  // sit on a support): good enough for the duration, not for feed-forward. Without an equilibrium
  // there, the gains are those of τ₀.
  const PathResult path = follow_equilibrium(robot_, from_N_, plan_.setpoint_N.front());
  feed_forward_ = false;
  double derived_s = 2.0 * kPi / leg_[0].slowest_rad_s() * 1.5;
  if (path.found) {
    leg_[0] = path.leg;
    derived_s = transition_time_s(path.leg, velocity_limit_m_s_);
  }
  if (plan_.transition_s[0] == 0.0) transition_s_[0] = derived_s;
}

void StartUp::begin_move() {
  command_.locked = false;
  controller_.reset(command_.velocity_m_s);
  if (lengths_) lengths_->reset(plan_.pose.front());
  rest_.clear();
}

void StartUp::move(const RobotSample& sample, double dt_s) {
  const auto k = static_cast<std::size_t>(command_.setpoint);
  const double duration_s = transition_s_[k];
  const double x = duration_s > 0.0 ? std::min(1.0, (now_s_ - entered_s_) / duration_s) : 1.0;
  place_.reset(fifth_degree(x), x < 1.0 ? FifthDegree::velocity(x) / duration_s : 0.0);
  const CableVector& target = plan_.setpoint_N[k];
  command_.tension_setpoint_N = from_N_ + place_.s() * (target - from_N_);
  if (lengths_) {
    command_.tension_setpoint_N += off_the_line_N(motion_[k], place_.s());
  } else {
    controller_.tune(leg_[k], place_.s());
  }
  control(sample, dt_s);
  if (x < 1.0) return;
  command_.tension_setpoint_N = target;
  rest_.clear();
  if (options_.wait_for_rest) {
    enter(StartUpState::settling);
  } else {
    next_setpoint();
  }
}

/// What the tensions on a way have more than on the straight line between its ends: their balance
/// there. Of the differences, since load cells may read something else.
CableVector StartUp::off_the_line_N(const HeldMotion& motion, double s) const {
  const auto lack_N = [&](double at) -> CableVector {
    const CableVector balanced_N = held_point(robot_, motion, at).tension_N;
    if (balanced_N.size() == 0) return CableVector::Zero(robot_.cable_count());
    return balanced_N - motion.from_N - at * motion.change_N;
  };
  return lack_N(s) - (1.0 - s) * lack_N(0.0) - s * lack_N(1.0);
}

void StartUp::control(const RobotSample& sample, double dt_s) {
  // A missing reading for a few samples: coast. The watchdog ends it when it lasts.
  if (!watchdog_.usable(sample)) {
    const CableVector none_N = CableVector::Zero(robot_.cable_count());
    command_.velocity_m_s = lengths_ ? lengths_->stop(none_N, dt_s) : controller_.coast(dt_s);
    return;
  }
  const auto k = static_cast<std::size_t>(command_.setpoint);
  const CableVector error_N = command_.tension_setpoint_N - sample.tension_N;
  if (lengths_) {
    command_.velocity_m_s =
        lengths_->step(motion_[k], place_.s(), place_.s_by_time_1_s(), error_N, dt_s);
    return;
  }
  along_m_s_ = place_.s_by_time_1_s() * leg_[k].length_by_fraction_m(place_.s());
  const CableVector none_m_s = CableVector::Zero(robot_.cable_count());
  command_.velocity_m_s = controller_.step(error_N, feed_forward_ ? along_m_s_ : none_m_s, dt_s);
}

void StartUp::settle() {
  const bool rests = rest_.at_rest();
  command_.ripple = rest_.ripple();
  if (rests && is_via(static_cast<std::size_t>(command_.setpoint))) {
    next_setpoint();
  } else if (rests) {
    enter(StartUpState::measuring);
  } else if (now_s_ - entered_s_ > options_.settle_timeout_s) {
    hold("set-point " + std::to_string(command_.setpoint + 1) +
         ": the platform does not come to rest in time");
  }
}

void StartUp::measure() {
  const bool rests = rest_.at_rest();
  command_.ripple = rest_.ripple();
  // Rest is judged over and over: a test may fail by chance, a motion fails it clearly.
  if (!rests && rest_.ripple() > 2.0) {
    rest_.clear();
    enter(StartUpState::settling);
    return;
  }
  if (now_s_ - entered_s_ < options_.measure_s - 1e-9) return;
  const double begin_s = entered_s_ - options_.rest.window_s;
  rests_.push_back({command_.setpoint, begin_s, now_s_});
  settle_sum_s_ += now_s_ - begin_s;
  next_setpoint();
}

void StartUp::next_setpoint() {
  if (static_cast<std::size_t>(command_.setpoint) + 1 == plan_.setpoint_N.size()) {
    enter(StartUpState::done);
    return;
  }
  from_N_ = plan_.setpoint_N[static_cast<std::size_t>(command_.setpoint)];
  ++command_.setpoint;
  begin_leg();
  feed_forward_ = true;
  command_.ripple = kNaN;
  rest_.clear();
  enter(StartUpState::moving);
}

double StartUp::planned_rest_s() const {
  constexpr double kSettling_s = 1.5;
  return options_.wait_for_rest ? kSettling_s + options_.rest.window_s + options_.measure_s : 0.0;
}

double StartUp::planned_duration_s() const {
  double sum = options_.record_s;
  for (const double t : transition_s_) sum += t + planned_rest_s();
  return sum;
}

double StartUp::estimate_remaining_s() const {
  using enum StartUpState;
  const std::size_t count = plan_.setpoint_N.size();
  if (command_.state == done) return 0.0;
  if (command_.state == holding) return kNaN;
  const double in_state_s = std::isnan(entered_s_) ? 0.0 : now_s_ - entered_s_;
  const double rest_s =
      rests_.empty() ? planned_rest_s() : settle_sum_s_ / static_cast<double>(rests_.size()) + 0.5;
  const auto k = static_cast<std::size_t>(command_.setpoint);
  double left = 0.0;
  for (std::size_t j = k + 1; j < count; ++j) left += transition_s_[j] + rest_s;
  switch (command_.state) {
    case idle:
    case recording:
      left += options_.record_s - in_state_s + transition_s_[k] + rest_s;
      break;
    case moving_to_start:
    case moving:
      left += transition_s_[k] - in_state_s + rest_s;
      break;
    case settling:
      left += std::max(options_.measure_s, rest_s - in_state_s);
      break;
    default:
      left += options_.measure_s - in_state_s;
      break;
  }
  return std::max(0.0, left);
}

}  // namespace cdprcal
