// Configuration faults: a sign, an order, a unit, a convention, a zero, a mounting. They change the
// readings' map itself, so they are found by trying, before any small effect is looked for.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cdprcal/calibration/calibrate.hpp"

namespace cdprcal {

/// One fault of a log: its name in the catalogue and what sets it right.
struct DiscreteFault {
  std::string name;            ///< length_sign, swivel_sign, cable_order, angle_unit, length_unit,
                               ///< tension_unit, length_factor, swivel_factor, tension_factor,
                               ///< tension_sign, attitude_sign, euler_convention; of
                               ///< fitted_faults: attitude_mounting, attitude_offset,
                               ///< tension_offset
  std::string parameter;       ///< "sign", "order", "factor", "convention", or a fitted one's
  std::vector<double> values;  ///< a cable: ±1, or the index (from 1) of the channel it is read on
  std::string text;            ///< for people
  /// Of a cable_order: the same for the load cells where it differs; else empty.
  std::vector<double> tension_order = {};
  /// The same for the swivel encoders.
  std::vector<double> swivel_order = {};
  /// Of the attitude's convention, which the robot has and no log: the right one.
  std::optional<EulerConvention> convention = std::nullopt;
  /// How probable it is before any reading, against a map that is right (1).
  double prior = 0.01;
  /// Other faults with which the readings agree as well, and the initial pose is another.
  std::vector<std::string> rivals = {};
  /// Nats, of one found by a refit among the effects; NaN of one found before any.
  double log_evidence = kNaN;
};

/// A fault of the readings as the robot file lists it; not for the Euler convention, which has a
/// place of its own there.
AppliedEffect as_listed(const DiscreteFault& fault);

/// The log (and, for the Euler convention, the robot) as it reads with a fault set right.
void set_right(const DiscreteFault& fault, Robot& robot, Log& log);

/// Faults of the attitude's map: Euler conventions, and the signs of roll, pitch and yaw. Near
/// level they change readings as little as an effect does.
std::vector<DiscreteFault> attitude_faults(const Robot& robot, const Log& log);

/// Every fault that is looked for in a log of these channels: those of the attitude, signs in any
/// combination, cables in any order (of more than six only the exchange of any two), units.
std::vector<DiscreteFault> discrete_faults(const Robot& robot, const Log& log);

/// Told what is done next; false: no more of it.
using GoOn = std::function<bool(const std::string&)>;

/// The discrete faults of a log, in the order found. Looks for them when the log contradicts the
/// model: tries each of discrete_faults(), keeps the one that lowers the cost most if it lowers it
/// tenfold, and looks again; where none makes the log agree, tries orders and signs together.
/// `robot` and `log` come back set right. Nothing is tried on a log that agrees with the model.
/// `motion`: where the log hardly rests, geometry says what agrees, and tensions by their level
/// unless they sway much; and where its readings do not balance in motion at all
/// (calibrate_in_motion), a fault of the attitude with which they do is taken. `go_on` is told each
/// step, every few seconds or less; with false no more is tried, and what was found is kept.
std::vector<DiscreteFault> find_discrete_faults(
    Robot& robot, Log& log, bool motion = false,
    const GoOn& go_on = [](const std::string&) { return true; });

}  // namespace cdprcal
