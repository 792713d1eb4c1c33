// What must never happen during the start-up, and how it is noticed.
#pragma once

#include <string>
#include <vector>

#include "cdprcal/model/robot.hpp"
#include "cdprcal/startup/robot_sample.hpp"

namespace cdprcal {

struct WatchdogOptions {
  double stale_s = 0.15;          ///< readings of the drives may be missing or old this long
  double attitude_stale_s = 0.5;  ///< those of the AHRS
  double tension_s = 0.2;         ///< a slack or overloaded cable is believed after this long
  double follow_s = 1.5;          ///< a tension may be off its set-point this long
  double stuck_s = 1.0;           ///< a reading that used to flicker may stand still this long
  double slack_share = 0.25;      ///< of the lower tension limit: less is slack
  double overload_share = 1.05;   ///< of the upper tension limit: more is too much
  double follow_share = 0.3;      ///< of the set-point: how far a tension may be off it
  double runaway_m = 0.05;        ///< cable commanded to move that the encoder does not show

  /// Tension below which a cable of a robot is slack [N].
  [[nodiscard]] double slack_N(const Robot& robot) const;
};

/// Looks at every sample. The first reason found is final.
class Watchdog {
 public:
  Watchdog(const Robot& robot, const WatchdogOptions& options = {});

  /// Empty, or why the robot must be stopped. `setpoint_N` empty: tensions are not controlled now.
  /// `velocity_m_s` was commanded since the last sample.
  const std::string& check(const RobotSample& sample, const CableVector& setpoint_N,
                           const CableVector& velocity_m_s);
  /// Whether lengths and tensions of this sample are all there: what control needs.
  [[nodiscard]] bool usable(const RobotSample& sample) const;
  /// Whether the reason lies in winches, encoders or load cells, which may not be relied on then.
  [[nodiscard]] bool doubts_winches() const { return doubts_winches_; }

 private:
  /// Time a condition has held without a break.
  class Timer {
   public:
    /// Seconds since `condition` became true; 0 when it is false.
    double held(bool condition, double now_s);

   private:
    double since_s_ = kNaN;
  };
  /// A reading that flickers by its noise, until it is stuck.
  struct Flicker {
    double value = kNaN, since_s = kNaN, longest_s = 0.0;
    int changes = 0;
  };
  void check_arrival(const RobotSample& sample);
  void check_tensions(const RobotSample& sample, const CableVector& setpoint_N);
  void check_stuck(const RobotSample& sample);
  void check_encoders(const RobotSample& sample, const CableVector& velocity_m_s, double dt_s);
  bool flickers(Flicker& flicker, double value, double now_s) const;
  /// `of_winches`: their readings, or they themselves, are not to be relied on any more.
  void raise(const std::string& reason, bool of_winches = true);

  WatchdogOptions options_;
  int n_;
  double slack_N_, overload_N_, floor_N_;
  std::string reason_;
  bool doubts_winches_ = false;
  double last_s_ = kNaN;
  bool had_attitude_ = false;
  CableVector had_swivel_;
  Timer missing_, attitude_missing_;
  std::vector<Timer> slack_, overload_, off_, swivel_missing_;
  std::vector<Flicker> tension_, length_;
  Flicker attitude_;
  CableVector length_then_m_, commanded_m_;  ///< since the encoder last moved
};

}  // namespace cdprcal
