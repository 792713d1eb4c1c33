// Imperfections of the simulated robot, by name and value: the catalogue of physical effects, as
// they act in the plant, and a few more that the catalogue does not have.
#pragma once

#include <string>
#include <vector>

#include "cdprcal/effects/parameter.hpp"
#include "cdprcal/model/robot.hpp"

namespace cdprcal {

class PlantValues;
struct PlantParameters;

/// One row of the table of what can be injected: an effect's card of the plant.
struct InjectableEffect {
  std::string name;
  std::string description;  ///< one line for people
  /// What it does to the plant: puts the values where they act. Throws InputError for values that
  /// this robot cannot have.
  void (*act)(PlantValues& values, PlantParameters& plant);
  /// What a robot file says of a reading's map sets it right; the plant has the map itself: the way
  /// back. Null where both say the same.
  std::vector<double> (*of_file)(const AppliedEffect& known) = nullptr;
  std::vector<ParameterLayout> parameters = {};  ///< none written: those of the effect or fault
  bool generator_only = false;  ///< not in the catalogue of the diagnosis: for blind tests
};

/// An effect and its numbers: its parameters one after the other, each as many as its shape says
/// (cable by cable). A per-cable parameter may also be one number for all cables, a per-cable
/// vector three for all.
struct InjectedEffect {
  std::string name;
  std::vector<double> values;
};

/// Everything that can be injected, in the order of the catalogue (plant_effects.cpp).
const std::vector<InjectableEffect>& injectable_effects();

/// Effects that a robot has beside the table, or in the place of its rows: formulas of its file.
using OwnEffects = std::vector<std::shared_ptr<const Effect>>;

/// Whether a formula of the robot's file has this name: it is then what the plant does.
bool is_own(const std::string& name, const OwnEffects& own);

/// Parses "NAME=v1,v2,…" (euler_convention also takes an order: "euler_convention=ZYX"). Throws
/// InputError naming the accepted effects, or the sizes and parameters of this one.
InjectedEffect parse_injected_effect(const std::string& text, const OwnEffects& own = {});

/// "NAME=v1,v2,…", which parse_injected_effect reads back to the bit.
std::string to_string(const InjectedEffect& effect);

/// The same effect with one number a parameter entry, scalars broadcast. Throws InputError naming
/// the accepted sizes when the number of values does not fit a robot with `cable_count` cables, for
/// values that are not finite, and for impossible ones (a sign other than ±1, no permutation …).
InjectedEffect expanded(const InjectedEffect& effect, int cable_count, const OwnEffects& own = {});

/// An effect that a robot file lists, as the plant takes it.
InjectedEffect as_injected(const AppliedEffect& known, const OwnEffects& own = {});

}  // namespace cdprcal
