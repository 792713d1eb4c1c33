#include "cdprcal/startup/startup.hpp"

#include <algorithm>

#include "cdprcal/error.hpp"
#include "cdprcal/geometry/fifth_degree.hpp"

namespace cdprcal {
namespace {

/// Cables may cross a fifth of the robot's size per second: the mean distance of the pulleys from
/// their middle. For a robot of 1.6 m that is 0.32 m/s.
double derived_velocity_m_s(const Robot& robot) {
  Vector3 middle = Vector3::Zero();
  for (const Cable& cable : robot.cables) middle += cable.pulley.position_m;
  middle /= robot.cable_count();
  double size = 0.0;
  for (const Cable& cable : robot.cables) size += (cable.pulley.position_m - middle).norm();
  size /= robot.cable_count();
  // One cable: its pulley is the middle. Take the platform's own size, or a metre.
  if (!(size > 1e-3)) size = 1.0;
  return 0.2 * size;
}

void check_options(const StartUpOptions& o) {
  const auto require = [](bool fine, const char* what) {
    if (!fine) throw InputError(std::string("start-up options: ") + what);
  };
  require(o.record_s >= 0.0 && o.measure_s >= 0.0 && o.settle_timeout_s > 0.0,
          "times must not be negative");
  require(o.velocity_limit_m_s >= 0.0, "velocity_limit_m_s must not be negative");
  require(o.control.bandwidth > 0.0 && o.control.filter > 0.0 && o.control.direction_error >= 0.0 &&
              o.control.axial_stiffness_N > 0.0,
          "control values must be positive");
  require(o.rest.window_s > 0.0 && o.rest.confidence > 0.0 && o.rest.confidence < 1.0 &&
              o.rest.tolerance >= 0.0,
          "rest: window_s must be above 0, confidence between 0 and 1, tolerance 0 or more");
}

void check_plan(const Robot& robot, StartUpPlan& plan) {
  if (plan.setpoint_N.empty()) throw InputError("start-up plan: no set-points; give at least one");
  for (std::size_t k = 0; k < plan.setpoint_N.size(); ++k) {
    const CableVector& t = plan.setpoint_N[k];
    const std::string name = "start-up plan: set-point " + std::to_string(k + 1);
    if (t.size() != robot.cable_count() || !t.allFinite()) {
      throw InputError(name + ": give " + std::to_string(robot.cable_count()) +
                       " finite tensions, one a cable");
    }
    if (t.minCoeff() < robot.tension_min_N || t.maxCoeff() > robot.tension_max_N) {
      throw InputError(name + ": a tension is outside the robot's limits; give one within");
    }
  }
  if (plan.transition_s.empty()) plan.transition_s.assign(plan.setpoint_N.size(), 0.0);
  if (plan.transition_s.size() != plan.setpoint_N.size()) {
    throw InputError("start-up plan: give as many transition times as set-points, or none");
  }
  if (!plan.via.empty() && plan.via.size() != plan.setpoint_N.size()) {
    throw InputError("start-up plan: say of every set-point whether it is via, or of none");
  }
  for (const double t : plan.transition_s) {
    if (!(t >= 0.0) || std::isinf(t))
      throw InputError("start-up plan: transition_s must be 0 or more");
  }
}

}  // namespace

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
  // Leg 0 starts at tensions nobody knows yet; until then it is the place τ₀.
  std::optional<Pose> at;
  for (std::size_t k = 0; k < plan_.setpoint_N.size(); ++k) {
    const CableVector& from = plan_.setpoint_N[k == 0 ? 0 : k - 1];
    PathResult path = follow_equilibrium(robot_, from, plan_.setpoint_N[k], at, k == 0 ? 1 : 9);
    if (!path.found) {
      throw InputError("start-up plan: no stable equilibrium on the way to set-point " +
                       std::to_string(k + 1) + ": " + path.reason +
                       "; make a plan with cdprcal plan");
    }
    at = path.leg.nodes.back().pose;
    if (transition_s_[k] == 0.0)
      transition_s_[k] = transition_time_s(path.leg, velocity_limit_m_s_);
    leg_.push_back(std::move(path.leg));
  }
  const int n = robot_.cable_count();
  command_.velocity_m_s.setZero(n);
  command_.tension_setpoint_N = plan_.setpoint_N.front();
  recorded_sum_N_.setZero(n);
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
  if (!checked.setpoint_N.empty()) check_plan(robot_, checked);
  const auto present = static_cast<std::size_t>(command_.setpoint);
  std::vector<PathLeg> legs;
  CableVector from = plan_.setpoint_N[present];
  std::optional<Pose> at = leg_[present].nodes.back().pose;
  for (std::size_t k = 0; k < checked.setpoint_N.size(); ++k) {
    PathResult path = follow_equilibrium(robot_, from, checked.setpoint_N[k], at);
    if (!path.found) {
      throw InputError("start-up plan: no stable equilibrium on the way to set-point " +
                       std::to_string(k + 1) + " of the rest: " + path.reason + "; choose another");
    }
    from = checked.setpoint_N[k];
    at = path.leg.nodes.back().pose;
    if (checked.transition_s[k] == 0.0) {
      checked.transition_s[k] = transition_time_s(path.leg, velocity_limit_m_s_);
    }
    legs.push_back(std::move(path.leg));
  }
  const auto replace = [&](auto& all, auto& by) {
    all.resize(present + 1);
    all.insert(all.end(), by.begin(), by.end());
  };
  plan_.via.resize(plan_.setpoint_N.size(), false);
  checked.via.resize(checked.setpoint_N.size(), false);
  replace(plan_.setpoint_N, checked.setpoint_N);
  replace(plan_.via, checked.via);
  replace(transition_s_, checked.transition_s);
  replace(leg_, legs);
  plan_.transition_s = transition_s_;
}

void StartUp::enter(StartUpState state) {
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
        sample, controlling ? command_.tension_setpoint_N : CableVector(), command_.velocity_m_s);
    if (std::isfinite(sample.time_s)) now_s_ = sample.time_s;
    if (!fault.empty()) hold(fault);
  } else if (std::isfinite(sample.time_s)) {
    now_s_ = std::max(now_s_, sample.time_s);
  }

  const bool usable = watchdog_.usable(sample);
  if (command_.state != holding && command_.state != done && usable) rest_.push(sample);
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
      control(sample, CableVector::Zero(robot_.cable_count()), dt_s);
      command_.state == settling ? settle() : measure();
      break;
    case done:
    case holding:
      break;
  }
  if (command_.state == done || command_.state == holding) {
    // A ramp needs a clock that runs; without one, stop at once.
    command_.velocity_m_s =
        dt_s > 0.0 ? controller_.stop(dt_s) : CableVector(CableVector::Zero(robot_.cable_count()));
    command_.locked = command_.velocity_m_s.isZero(0.0);
  }
  command_.remaining_s = estimate_remaining_s();
  return command_;
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
  rest_.clear();
}

void StartUp::move(const RobotSample& sample, double dt_s) {
  const auto k = static_cast<std::size_t>(command_.setpoint);
  const double duration_s = transition_s_[k];
  const double x = duration_s > 0.0 ? std::min(1.0, (now_s_ - entered_s_) / duration_s) : 1.0;
  const double fraction = fifth_degree(x);
  const CableVector& target = plan_.setpoint_N[k];
  command_.tension_setpoint_N = from_N_ + fraction * (target - from_N_);
  CableVector feed_forward = CableVector::Zero(robot_.cable_count());
  if (feed_forward_ && x < 1.0) {
    const double speed = 30.0 * x * x * (1.0 - x) * (1.0 - x) / duration_s;
    feed_forward = speed * leg_[k].length_by_fraction_m(fraction);
  }
  controller_.tune(leg_[k], fraction);
  control(sample, feed_forward, dt_s);
  if (x < 1.0) return;
  command_.tension_setpoint_N = target;
  rest_.clear();
  enter(StartUpState::settling);
}

void StartUp::control(const RobotSample& sample, const CableVector& feed_forward_m_s, double dt_s) {
  // A missing reading for a few samples: coast. The watchdog ends it when it lasts.
  if (!watchdog_.usable(sample)) {
    command_.velocity_m_s = controller_.stop(dt_s);
    return;
  }
  command_.velocity_m_s =
      controller_.step(command_.tension_setpoint_N - sample.tension_N, feed_forward_m_s, dt_s);
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
  feed_forward_ = true;
  command_.ripple = kNaN;
  rest_.clear();
  enter(StartUpState::moving);
}

double StartUp::planned_duration_s() const {
  constexpr double kSettling_s = 1.5;
  double sum = options_.record_s;
  for (const double t : transition_s_) {
    sum += t + kSettling_s + options_.rest.window_s + options_.measure_s;
  }
  return sum;
}

double StartUp::estimate_remaining_s() const {
  using enum StartUpState;
  const std::size_t count = plan_.setpoint_N.size();
  if (command_.state == done) return 0.0;
  if (command_.state == holding) return kNaN;
  const double in_state_s = std::isnan(entered_s_) ? 0.0 : now_s_ - entered_s_;
  const double rest_s = rests_.empty() ? 1.5 + options_.rest.window_s + options_.measure_s
                                       : settle_sum_s_ / static_cast<double>(rests_.size()) + 0.5;
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
