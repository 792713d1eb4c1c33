// Effects that a person writes as text: names, parameters, and formulas of what they add.
//
// What a formula may name, and what it may add to, are two tables in text_effect.cpp.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cdprcal/effects/effect.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal {

/// One effect as its text says it.
struct EffectDefinition {
  struct Parameter {
    std::string name;  ///< with the unit as suffix: "amplitude_m"
    bool per_cable = false;
    double typical = 0.0;    ///< one σ of the prior, in the parameter's unit
    double plausible = 0.0;  ///< largest believable size
  };
  struct Addition {
    std::string to;       ///< what it adds to: "length_m", "tension_N", "mass_kg" …
    std::string formula;  ///< in the names of variable_names() and of the parameters
  };
  std::string name;
  std::string sentence, remedy, settle;  ///< for people, as EffectInfo has them; may be empty
  EffectScope scope = EffectScope::robot;
  bool one_sided = false;
  std::vector<Parameter> parameters;
  std::vector<Addition> adds;
};

/// A definition that cannot be used: the field of it ("adds.length_m"), what is wrong, and at
/// which character of a formula, from 0.
struct DefinitionError : InputError {
  DefinitionError(std::string of_field, const std::string& problem,
                  std::optional<std::size_t> at = std::nullopt)
      : InputError(problem), field(std::move(of_field)), offset(at) {}
  std::string field;
  std::optional<std::size_t> offset;
};

/// An effect like those of the catalogue. Derivatives are automatic (forward, dual numbers), and
/// compared with differences at random places; so is that zero means absent. Throws
/// DefinitionError.
enum class Trust { anybodys, ours };  ///< ours: written by this library, not compared again
std::shared_ptr<const Effect> text_effect(const EffectDefinition& definition,
                                          Trust trust = Trust::anybodys);

/// Of an effect that was written as text; null for those of the catalogue.
const EffectDefinition* definition_of(const Effect& effect);

/// The first formula of an effect of text at one place: what it adds there, and the first of its
/// variables.
struct FormulaAt {
  std::string to, variable;
  bool per_cable = false;  ///< else the same for all cables
  double x = 0.0, added = 0.0;
};
/// Nothing for an effect of the catalogue, and for a formula without a variable.
std::optional<FormulaAt> formula_at(const Effect& effect, const EffectContext& context,
                                    const EffectValues& values, int cable);

/// What formulas may name beside parameters and functions, and what they may add to: name and
/// meaning, for people.
struct NamedMeaning {
  std::string name, meaning;
};
std::vector<NamedMeaning> formula_variables();
std::vector<NamedMeaning> formula_targets();
std::vector<std::string> formula_functions();

}  // namespace cdprcal
