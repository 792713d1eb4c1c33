// The start-up procedure on the simulated robot: a whole run in a fraction of a second.
#pragma once

#include <functional>
#include <optional>

#include "cdprcal/readings/equilibrium_detection.hpp"
#include "cdprcal/readings/log.hpp"
#include "cdprcal/simulator/simulator.hpp"
#include "cdprcal/startup/startup.hpp"

namespace cdprcal {

struct StartUpChange {
  double time_s = 0.0;
  StartUpState state = StartUpState::idle;
  int setpoint = 0;
};

/// What happened; the log is there whatever the outcome.
struct StartUpRun {
  StartUpState state =
      StartUpState::idle;  ///< done or holding; idle: the robot could not be placed
  std::string reason;      ///< not done: why
  Log log;
  std::vector<PlantTruth> truth;                        ///< one a row of the log
  std::vector<StartUpRest> rests;                       ///< as detected on line
  std::vector<SampleRange> rest_rows;                   ///< the rows of the log of each rest
  std::vector<StartUpChange> changes;                   ///< state history
  double min_setpoint_N = kNaN, max_setpoint_N = kNaN;  ///< of all commanded tensions
  double max_velocity_m_s = 0.0;                        ///< largest commanded
  double max_tension_N = 0.0;  ///< largest true tension in a row of the log
};

struct StartUpRunOptions {
  SimulatorOptions simulator;
  StartUpOptions startup;
  double control_rate_Hz = 100.0;  ///< how often StartUp is asked
  double log_rate_Hz = 10.0;       ///< rows of the log; at most the control rate
  double max_duration_s = 3600.0;  ///< of the robot's time: ends as holding
  /// True tensions at power-on [N], n values; empty: the first set-point.
  CableVector initial_tension_N;
  /// Where the platform is at power-on when lengths lead it (StartUpPlan::pose), under the tensions
  /// in balance there closest to the initial ones; nothing: at the plan's first pose.
  std::optional<Pose> initial_pose;
  /// Changes what StartUp is told, for fault injection. Called with every sample.
  std::function<void(RobotSample&)> tamper;
  /// Called with every command; false stops the run as the operator would.
  std::function<bool(const StartUpCommand&, const RobotSample&)> progress;
};

/// Places the robot at rest under the initial tensions, then runs the plan to the end. `robot` is
/// what the robot is believed to be; the plant has the injected effects. Throws InputError like
/// StartUp and Simulator.
StartUpRun simulate_startup(const Robot& robot, const StartUpPlan& plan,
                            const StartUpRunOptions& options = {});

}  // namespace cdprcal
