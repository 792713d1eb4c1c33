// Effects that the robot file lists, made ready for use; and found ones, made ready for the file.
#pragma once

#include <optional>

#include "cdprcal/effects/effect.hpp"
#include "cdprcal/readings/log.hpp"

namespace cdprcal {

/// One effect, of the catalogue or the robot's own, with its internal values. Throws InputError for
/// an unknown name or the wrong number of values.
ActiveEffect resolve_effect(const Robot& robot, const AppliedEffect& applied);

/// The effects that a robot lists for a run: those of every run, and those of the
/// log of that name (run_names).
ActiveEffects resolve_effects(const Robot& robot, const std::string& log_source);

/// The log with the faults that the robot lists for it set right, in their order; nothing when
/// there are none. Throws InputError when the log has another number of cables than the robot.
std::optional<Log> correct_readings(const Robot& robot, const Log& log);

/// The tensions of a measurement without what its load cells add, of known effects: what the cables
/// carry, as far as it can be said without a model.
CableVector true_tension_N(const Robot& robot, const ActiveEffects& effects, const Measurement& m);

/// By how much a tension at the platform changes with its load cell's reading: what the cell's
/// noise is multiplied by on its way there.
CableVector true_tension_by_reading(const Robot& robot, const ActiveEffects& effects,
                                    const Measurement& m);

/// Robot and log with all that the robot lists for that log taken into account, for whoever looks
/// at readings without a model: correct_readings, geometry and inertia as they are, and
/// true_tension_N.
struct KnownState {
  Robot robot;  ///< lists nothing any more
  Log log;
};
KnownState with_known_effects(const Robot& robot, const Log& log);

/// An effect as a robot file lists it, from values in reported units.
AppliedEffect applied_effect(const Effect& effect, const EffectValues& reported, int cables);

/// What AppliedEffect::run holds for each of several logs: the file name, with as many folders
/// before it as tell it from the others'. It matches every log whose path ends with it.
std::vector<std::string> run_names(const std::vector<std::string>& log_sources);

}  // namespace cdprcal
