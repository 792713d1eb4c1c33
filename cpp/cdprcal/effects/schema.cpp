#include "cdprcal/effects/schema.hpp"

#include <algorithm>

#include "cdprcal/effects/applied.hpp"
#include "cdprcal/effects/catalogue.hpp"
#include "cdprcal/effects/reading_faults.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/model/robot_check.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

/// A file may hold ten times what a diagnosis would believe. Beyond, it is a slip: mm for m.
constexpr double kFarBeyondPlausible = 10.0;

std::string effect_field(std::size_t index, const std::string& name) {
  const std::string field = "effects[#" + std::to_string(index + 1) + "]";
  return name.empty() ? field : field + "." + name;
}

void check_parameters(const AppliedEffect& effect, const EffectLayout& layout, int cables,
                      std::size_t index) {
  for (const AppliedEffect::Parameter& given : effect.parameters) {
    const bool known =
        std::any_of(layout.parameters.begin(), layout.parameters.end(),
                    [&](const ParameterLayout& parameter) { return parameter.name == given.name; });
    if (!known) {
      throw detail::FieldError(effect_field(index, given.name),
                               "is no parameter of " + effect.name + "; delete it");
    }
  }
  for (const ParameterLayout& parameter : layout.parameters) {
    const std::string field = effect_field(index, parameter.name);
    const auto matches = [&](const AppliedEffect::Parameter& p) {
      return p.name == parameter.name;
    };
    const auto count = std::count_if(effect.parameters.begin(), effect.parameters.end(), matches);
    if (count == 0 && parameter.optional) continue;
    if (count != 1)
      throw detail::FieldError(field,
                               count == 0 ? "is missing: add it" : "given twice; delete one");
    const auto given = std::find_if(effect.parameters.begin(), effect.parameters.end(), matches);
    const auto size = static_cast<std::size_t>(entries(parameter.shape, cables));
    if (given->values.size() != size) {
      throw detail::FieldError(field, "must have " + std::to_string(size) + " values, not " +
                                          std::to_string(given->values.size()));
    }
    const auto finite = [](double value) { return std::isfinite(value); };
    if (!std::all_of(given->values.begin(), given->values.end(), finite)) {
      throw detail::FieldError(field, "must be finite numbers");
    }
    // An estimate may be beyond what a machine's numbers can be: the effect is then not there.
    if (!is_reading_fault(effect.name)) continue;
    const std::string problem = range_problem(parameter.range, given->values, cables);
    if (!problem.empty()) throw detail::FieldError(field, problem);
  }
}

void check_own_effects(const Robot& robot) {
  for (std::size_t i = 0; i < robot.own_effects.size(); ++i) {
    for (std::size_t other = 0; other < i; ++other) {
      if (robot.own_effects[other]->name() != robot.own_effects[i]->name()) continue;
      throw detail::FieldError("effect_definitions[#" + std::to_string(i + 1) + "].name",
                               "given twice; delete one");
    }
  }
}

}  // namespace

EffectLayout layout_of(const Effect& effect) {
  EffectLayout layout{effect.name(), {}};
  for (const EffectParameter& p : effect.info().parameters) {
    layout.parameters.push_back({p.name, p.shape, p.range});
  }
  return layout;
}

const std::vector<EffectLayout>& effect_layouts() {
  static const std::vector<EffectLayout> all = [] {
    std::vector<EffectLayout> layouts;
    for (const auto& effect : effect_catalogue()) layouts.push_back(layout_of(*effect));
    for (const ReadingFault& fault : reading_faults()) {
      layouts.push_back({fault.name, fault.parameters});
    }
    return layouts;
  }();
  return all;
}

std::optional<EffectLayout> effect_layout(const Robot& robot, const std::string& name) {
  for (const EffectLayout& layout : effect_layouts()) {
    if (layout.name == name) return layout;
  }
  for (const auto& effect : robot.own_effects) {
    if (effect->name() == name) return layout_of(*effect);
  }
  return std::nullopt;
}

std::string unknown_effect(const Robot& robot, const std::string& name) {
  std::string known;
  for (const EffectLayout& layout : effect_layouts()) {
    add_item(known, layout.name);
  }
  for (const auto& effect : robot.own_effects) known += ", " + effect->name();
  return "unknown effect " + in_quotes(name) + "; known: " + known;
}

namespace detail {

void check_effects(const Robot& robot) {
  check_own_effects(robot);
  Robot changed = robot;
  for (std::size_t i = 0; i < robot.effects.size(); ++i) {
    const AppliedEffect& effect = robot.effects[i];
    const std::optional<EffectLayout> layout = effect_layout(robot, effect.name);
    if (!layout) throw FieldError(effect_field(i, "name"), unknown_effect(robot, effect.name));
    for (const char c : effect.run) {
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
        throw FieldError(effect_field(i, "run"), "must not hold control characters");
      }
    }
    check_parameters(effect, *layout, robot.cable_count(), i);
    if (is_reading_fault(effect.name)) continue;
    const ActiveEffect active = resolve_effect(robot, effect);
    const std::string first = effect.parameters.front().name;
    if (!active.values.allFinite()) {
      throw FieldError(effect_field(i, first),
                       "is impossible for a " + effect.name + "; correct it");
    }
    const EffectValues bound = kFarBeyondPlausible * active.effect->plausible(robot);
    if (!(active.values.cwiseAbs().array() <= bound.array()).all()) {
      throw FieldError(effect_field(i, first),
                       "is far from anything physically plausible: check the unit in the name");
    }
    active.effect->apply(active.values, changed);
    if (!(changed.platform.mass_kg > kLeastMassShare * robot.platform.mass_kg)) {
      throw FieldError(effect_field(i, first), "leaves the platform without mass; correct it");
    }
  }
}

}  // namespace detail

void check_effects(const Robot& robot) {
  detail::as_input_error([&] { detail::check_effects(robot); });
}

}  // namespace cdprcal
