// The start-up procedure (paper §3.2.2, Fig. 3): from power-on through all tension set-points.
//
// One class drives every backend, simulated or real: it is a pure function of the samples given to
// it, without a clock, without input or output of its own.
//
//   StartUp startup(robot, plan);
//   for (;;) {
//     const StartUpCommand command = startup.step(backend.read());
//     backend.command(command.velocity_m_s);       // or of the tensions, in torque mode
//     if (startup.finished()) break;
//   }
//
// Safe hold: the winches come to a stop and stay locked. A platform that hangs on locked cables is
// where gravity wants it whatever the sensors say; tension control would let it run away with the
// first load cell that lies. With winches or load cells in doubt, and where this computer stops the
// run (the platform goes where it must not), they stop within 0.2 s, on along their way: cables
// that stop each for itself would fall slack, and others catch the platform. With a stop on purpose
// (operator, end) or for another reason the tensions count until all stand still: their set-points,
// or where lengths lead these, come to rest within 0.2 s, and where tensions lead the platform has
// one swing, and 5 s at most, to do so too.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cdprcal/startup/length_controller.hpp"
#include "cdprcal/startup/rest_detector.hpp"
#include "cdprcal/startup/tension_controller.hpp"
#include "cdprcal/startup/watchdog.hpp"

namespace cdprcal {

/// What to visit. The first set-point is τ₀; the run measures at every one of them.
struct StartUpPlan {
  std::vector<CableVector> setpoint_N;  ///< each n values within the tension limits
  /// Time of the transition to each set-point [s]. Empty, or 0 for one: derived from the robot (see
  /// transition_time_s). The first is from the tensions found at power-on.
  std::vector<double> transition_s = {};
  /// One a set-point: true settles there and goes on without measuring, because no direct way is
  /// safe. Empty: every set-point is measured.
  std::vector<bool> via = {};
  /// One a set-point, for cables that hold the whole pose: lengths lead the platform from pose to
  /// pose, the first being where it hangs at power-on, near enough; n−f cables follow the tensions
  /// (f: how many hold it). Empty, or fewer cables: all follow tensions, and these lead the
  /// platform.
  std::vector<Pose> pose = {};
};

struct StartUpOptions {
  double record_s = 1.0;           ///< tensions at power-on are averaged over this long
  double measure_s = 1.0;          ///< rest is kept this long after it was detected
  double settle_timeout_s = 20.0;  ///< for rest after a transition
  /// False: set-points are passed without waiting for rest there, and nothing is measured but the
  /// motion (calibrate_in_motion).
  bool wait_for_rest = true;
  /// No cable is told to move faster. 0: robot size × 0.2 / s (see velocity_limit_m_s()).
  double velocity_limit_m_s = 0.0;
  TensionControlOptions control;
  RestOptions rest;
  WatchdogOptions watchdog;
};

enum class StartUpState {
  idle,             ///< before the first sample
  recording,        ///< tensions at power-on; winches locked
  moving_to_start,  ///< to τ₀
  moving,           ///< to the next set-point
  settling,         ///< until rest is detected
  measuring,        ///< resting, measure_s
  done,             ///< all set-points measured; winches locked
  holding           ///< stopped early; `reason` says why
};
const char* to_string(StartUpState state);

struct StartUpCommand {
  StartUpState state = StartUpState::idle;
  std::string reason;              ///< holding: why
  CableVector velocity_m_s;        ///< of pay-out, for drives in velocity mode
  CableVector tension_setpoint_N;  ///< wanted now; for drives in torque mode, and for the log
  /// One a cable, for drives with a tension loop: true where it follows its tension set-point and
  /// false where it must follow velocity_m_s. All where tensions lead the platform, n−f of them,
  /// other ones from way to way, where lengths do; none in a stop that trusts no load cell.
  std::vector<bool> by_tension;
  bool locked = true;         ///< winches must stand still: brakes may be set
  int setpoint = 0;           ///< which one is being moved to or measured, from 0
  double ripple = kNaN;       ///< motion ÷ what rest allows (settling, measuring)
  double remaining_s = kNaN;  ///< estimate of the time to the end
};

/// One measured rest.
struct StartUpRest {
  int setpoint = 0;
  double begin_s = 0.0, end_s = 0.0;
};

class StartUp {
 public:
  /// Throws InputError when the plan is empty, has set-points outside the tension limits or of the
  /// wrong size, no stable equilibrium at a set-point or on the way to it (led by lengths: poses at
  /// which the cables do not hold the platform), or impossible options.
  StartUp(const Robot& robot, StartUpPlan plan, const StartUpOptions& options = {});

  /// Takes the sample and says what to do until the next. To be called at 50 Hz or more.
  const StartUpCommand& step(const RobotSample& sample);

  /// What was measured is enough: the run ends `done` where it is, the winches stop and lock. No
  /// effect on a run that has ended.
  void finish();
  /// Other stops than the plan's after the present set-point, or after the one being moved to; each
  /// way is followed as in the constructor. Throws InputError for what the constructor refuses and
  /// for a run that has ended; the plan is as before then.
  void go_on_with(const StartUpPlan& rest);

  /// Nothing more will happen, and the winches stand still.
  [[nodiscard]] bool finished() const;
  [[nodiscard]] StartUpState state() const { return command_.state; }
  [[nodiscard]] const std::string& reason() const { return command_.reason; }
  /// The rests measured so far.
  [[nodiscard]] const std::vector<StartUpRest>& rests() const { return rests_; }
  [[nodiscard]] double velocity_limit_m_s() const { return velocity_limit_m_s_; }
  /// Time of the transition to set-point k [s]. That of the first is known once moving.
  [[nodiscard]] double transition_s(std::size_t k) const { return transition_s_[k]; }
  /// Duration [s] of the whole run as planned, settling estimated.
  [[nodiscard]] double planned_duration_s() const;

 private:
  void enter(StartUpState state);
  void hold(const std::string& reason);
  void record(const RobotSample& sample);
  void plan_first_leg();
  /// The legs to set-points from the one before, whose equilibrium is at `at`; their times are
  /// filled in where they are 0. `name` says whose set-points these are.
  struct Legs {
    std::vector<PathLeg> by_tension;
    std::vector<HeldMotion> by_length;
    std::vector<std::vector<int>> led_by_tension;  ///< one a motion by length
  };
  [[nodiscard]] Legs legs_of(const StartUpPlan& plan, CableVector from_N, std::optional<Pose> at,
                             std::vector<double>& transition_s, const std::string& of) const;
  [[nodiscard]] bool led_by_lengths() const { return lengths_.has_value(); }
  [[nodiscard]] CableVector watched_setpoint_N() const;
  void begin_move();
  void begin_leg();
  void move(const RobotSample& sample, double dt_s);
  void control(const RobotSample& sample, double dt_s);
  void stop(const RobotSample& sample, bool usable, double dt_s);
  void calm(const RobotSample& sample, double dt_s);
  [[nodiscard]] double patience_to_stop_s() const;
  [[nodiscard]] CableVector off_the_line_N(const HeldMotion& motion, double s) const;
  void settle();
  void measure();
  void next_setpoint();
  [[nodiscard]] bool is_via(std::size_t k) const { return k < plan_.via.size() && plan_.via[k]; }
  [[nodiscard]] double estimate_remaining_s() const;
  [[nodiscard]] double planned_rest_s() const;

  Robot robot_;
  StartUpPlan plan_;
  StartUpOptions options_;
  double velocity_limit_m_s_;
  std::vector<PathLeg> leg_;  ///< to each set-point; the first is found when recorded
  std::vector<double> transition_s_;
  std::vector<HeldMotion> motion_;                ///< led by lengths: in place of leg_
  std::vector<std::vector<int>> led_by_tension_;  ///< on each: the cables that follow tensions
  TensionController controller_;
  std::optional<LengthController> lengths_;
  RestDetector rest_;
  Watchdog watchdog_;
  StartUpCommand command_;
  std::vector<StartUpRest> rests_;
  CableVector from_N_, recorded_sum_N_, last_tension_N_;
  int recorded_ = 0;
  double now_s_ = kNaN, entered_s_ = kNaN;
  double usable_s_ = kNaN;     ///< when all that control needs was last read
  double settle_sum_s_ = 0.0;  ///< over rests_: the estimate of the time left learns
  bool feed_forward_ = false;
  PlaceOnLeg place_;
  /// Tensions lead: how fast the winches run there if all is as it should be.
  CableVector along_m_s_;
  double calm_s_ = kNaN;  ///< of a run that has ended: tensions lead the platform to a stop so long
};

}  // namespace cdprcal
