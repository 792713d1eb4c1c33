#include "cdprcal/robot_file/effect_definitions.hpp"

#include "cdprcal/effects/schema.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/model/robot_check.hpp"
#include "cdprcal/robot_file/definition_reader.hpp"
#include "cdprcal/text.hpp"
#include "cdprcal/text_file.hpp"

namespace cdprcal {

using detail::YamlField;
using detail::YamlMapping;

namespace detail {
namespace {

EffectDefinition read_definition(const YamlField& field) {
  const YamlMapping map(
      field, {"name", "says", "remedy", "settle", "scope", "one_sided", "parameters", "adds"});
  EffectDefinition out;
  out.name = map.require("name").text();
  const auto text_of = [&](const char* key) {
    const auto found = map.find(key);
    return found ? one_line(found->text()) : std::string();
  };
  out.sentence = text_of("says");
  out.remedy = text_of("remedy");
  out.settle = text_of("settle");
  out.scope = map.word_or("scope", {"robot", "run"}) == 1 ? EffectScope::run : EffectScope::robot;
  out.one_sided = map.word_or("one_sided", {"false", "true"}) == 1;
  for (const auto& [name, parameter] : map.require("parameters").entries()) {
    const YamlMapping of(parameter, {"per", "typical", "plausible"});
    out.parameters.push_back({name, of.word_or("per", {"common", "cable"}) == 1,
                              of.require("typical").number(), of.require("plausible").number()});
  }
  for (const auto& [to, formula] : map.require("adds").entries()) {
    out.adds.push_back({to, formula.text()});
  }
  return out;
}

}  // namespace

std::vector<std::shared_ptr<const Effect>> read_definitions(const YamlField& list) {
  std::vector<std::shared_ptr<const Effect>> effects;
  for (const YamlField& item : list.items()) {
    const EffectDefinition definition = read_definition(item);
    try {
      effects.push_back(text_effect(definition));
    } catch (const DefinitionError& error) {
      const std::string path = item.path() + "." + error.field;
      list.fail_at(path, error.what(), error.offset);
    }
    for (std::size_t other = 0; other + 1 < effects.size(); ++other) {
      if (effects[other]->name() == definition.name) {
        list.fail_at(item.path() + ".name", "given twice; delete one");
      }
    }
  }
  return effects;
}

}  // namespace detail

std::vector<std::shared_ptr<const Effect>> parse_effects(const std::string& yaml_text,
                                                         const std::string& source) {
  const YamlField document = YamlField::parse_document(yaml_text, source);
  return detail::read_definitions(
      YamlMapping(document, {"effect_definitions"}).require("effect_definitions"));
}

std::vector<std::shared_ptr<const Effect>> load_effects(const std::string& path) {
  return parse_effects(read_text_file(path, detail::kMostYamlBytes + 1), path);
}

Robot with_own_effects(Robot robot, const std::vector<std::shared_ptr<const Effect>>& effects) {
  std::erase_if(robot.own_effects, [&](const auto& own) {
    return std::ranges::any_of(effects,
                               [&](const auto& other) { return other->name() == own->name(); });
  });
  robot.own_effects.insert(robot.own_effects.end(), effects.begin(), effects.end());
  check_effects(robot);
  return robot;
}

std::string effects_to_yaml(const std::vector<std::shared_ptr<const Effect>>& effects) {
  std::string out;
  const auto line = [&](const char* key, const std::string& text) {
    if (!text.empty()) out += std::string("    ") + key + ": " + detail::double_quoted(text) + "\n";
  };
  for (const auto& effect : effects) {
    const EffectDefinition* definition = definition_of(*effect);
    if (!definition) continue;
    if (out.empty()) out = "effect_definitions:\n";
    out += "  - name: " + definition->name + "\n";
    line("says", definition->sentence);
    line("remedy", definition->remedy);
    line("settle", definition->settle);
    if (definition->scope == EffectScope::run) out += "    scope: run\n";
    if (definition->one_sided) out += "    one_sided: true\n";
    out += "    parameters:\n";
    for (const EffectDefinition::Parameter& p : definition->parameters) {
      out += "      " + p.name + ": {per: " + (p.per_cable ? "cable" : "common") +
             ", typical: " + shortest(p.typical) + ", plausible: " + shortest(p.plausible) + "}\n";
    }
    out += "    adds:\n";
    for (const auto& [to, formula] : definition->adds) {
      out += "      " + to + ": " + detail::double_quoted(formula) + "\n";
    }
  }
  return out;
}

}  // namespace cdprcal
