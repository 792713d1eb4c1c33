// Imperfections of the simulated robot, by name and value: the catalogue of physical effects, as
// they act in the plant, and a few more that the catalogue does not have.
#pragma once

#include <string>
#include <vector>

#include "cdprcal/types.hpp"

namespace cdprcal {

/// How many numbers a parameter of an injected effect has.
enum class InjectedShape { scalar, per_cable, vector3, per_cable_vector3 };

struct InjectedParameter {
  std::string name;  ///< with the unit as suffix: "bias_N"
  InjectedShape shape;
};

/// One row of the table of what can be injected.
struct InjectableEffect {
  std::string name;
  std::vector<InjectedParameter> parameters;
  bool generator_only = false;  ///< not in the catalogue of the diagnosis: for blind tests
  std::string description;      ///< one line for people
};

/// An effect and its numbers: its parameters one after the other, each as many as its shape says
/// (cable by cable). A per-cable parameter may also be one number for all cables, a per-cable
/// vector three for all.
struct InjectedEffect {
  std::string name;
  std::vector<double> values;
};

/// Everything that can be injected, in the order of the catalogue.
const std::vector<InjectableEffect>& injectable_effects();

/// Parses "NAME=v1,v2,…" (euler_convention also takes an order: "euler_convention=ZYX"). Throws
/// InputError naming the accepted effects, or the sizes and parameters of this one.
InjectedEffect parse_injected_effect(const std::string& text);

/// "NAME=v1,v2,…", which parse_injected_effect reads back to the bit.
std::string to_string(const InjectedEffect& effect);

/// The same effect with one number a parameter entry, scalars broadcast. Throws InputError naming
/// the accepted sizes when the number of values does not fit a robot with `cable_count` cables, for
/// values that are not finite, and for impossible ones (a sign other than ±1, no permutation …).
InjectedEffect expanded(const InjectedEffect& effect, int cable_count);

}  // namespace cdprcal
