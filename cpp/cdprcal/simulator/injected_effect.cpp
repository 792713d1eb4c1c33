#include "cdprcal/simulator/injected_effect.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "cdprcal/effects/effect.hpp"
#include "cdprcal/effects/schema.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/geometry/euler.hpp"
#include "cdprcal/readings/log_columns.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

InjectableEffect find(const std::string& name, const OwnEffects& own) {
  std::string known;
  for (const InjectableEffect& effect : injectable_effects()) {
    if (effect.name == name && !is_own(name, own)) return effect;
    add_item(known, effect.name);
  }
  for (const auto& effect : own) {
    const EffectLayout layout = layout_of(*effect);
    if (layout.name == name)
      return {name, effect->info().sentence, nullptr, nullptr, layout.parameters};
    known += ", " + layout.name;
  }
  throw InputError("effect " + in_quotes(name) + ": not known; give one of " + known);
}

std::string sizes_text(const InjectableEffect& effect) {
  constexpr const char* kSizes[] = {"", " [1 or n]", " [3]", " [3 or n*3]", " [2]"};
  std::string text;
  for (const ParameterLayout& parameter : effect.parameters) {
    add_item(text, parameter.name + kSizes[static_cast<std::size_t>(parameter.shape)]);
  }
  return text;
}

[[noreturn]] void fail(const InjectableEffect& effect, const std::string& what) {
  throw InputError("effect " + effect.name + ": " + what + "; it takes " + sizes_text(effect));
}

double parse_number(const InjectableEffect& effect, std::string text) {
  const auto is_space = [](char c) { return c == ' ' || c == '\t'; };
  while (!text.empty() && is_space(text.back())) text.pop_back();
  text.erase(text.begin(), std::find_if_not(text.begin(), text.end(), is_space));
  if (effect.parameters.front().range == ValueRange::euler_convention && text.size() == 3 &&
      text.find_first_not_of("XYZ") == std::string::npos) {
    try {
      return static_cast<double>(parse_euler_convention(text));
    } catch (const InputError&) {
      fail(effect, in_quotes(text) + " must be one of XYZ, XZY, YXZ, YZX, ZXY, ZYX");
    }
  }
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const char* end = text.data() + text.size();
  double value = 0.0;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || stop != end || !std::isfinite(value)) {
    fail(effect, in_quotes(text) + " must be a finite number");
  }
  return value;
}

/// All parameters' entries together.
std::size_t total(const InjectableEffect& effect, int cables) {
  int count = 0;
  for (const ParameterLayout& p : effect.parameters) count += entries(p.shape, cables);
  return static_cast<std::size_t>(count);
}

}  // namespace

bool is_own(const std::string& name, const OwnEffects& own) {
  return std::ranges::any_of(own, [&](const auto& effect) { return effect->name() == name; });
}

InjectedEffect parse_injected_effect(const std::string& text, const OwnEffects& own) {
  const std::size_t equal = text.find('=');
  const InjectableEffect effect = find(text.substr(0, equal), own);
  InjectedEffect parsed{effect.name, {}};
  if (equal == std::string::npos) fail(effect, "write " + effect.name + "=v1,v2,…");
  for (std::size_t begin = equal + 1;;) {
    const std::size_t comma = text.find(',', begin);
    parsed.values.push_back(parse_number(effect, text.substr(begin, comma - begin)));
    if (comma == std::string::npos) break;
    begin = comma + 1;
  }
  return parsed;
}

std::string to_string(const InjectedEffect& effect) {
  std::string text = effect.name;
  for (std::size_t i = 0; i < effect.values.size(); ++i) {
    text += (i == 0 ? '=' : ',') + shortest(effect.values[i]);
  }
  return text;
}

InjectedEffect expanded(const InjectedEffect& injected, int cable_count, const OwnEffects& own) {
  const InjectableEffect effect = find(injected.name, own);
  const bool full = injected.values.size() == total(effect, cable_count);
  // The short form is that of a robot with one cable. An order has none.
  const bool brief = injected.values.size() == total(effect, 1) &&
                     effect.parameters.front().range != ValueRange::order;
  if (!full && !brief) {
    fail(effect, std::to_string(injected.values.size()) + " values do not fit " +
                     std::to_string(cable_count) + " cables; give one a cable");
  }
  InjectedEffect out{effect.name, {}};
  auto given = injected.values.begin();
  for (const ParameterLayout& parameter : effect.parameters) {
    const int count = entries(parameter.shape, full ? cable_count : 1);
    const int repeat = entries(parameter.shape, cable_count) / count;
    std::vector<double> values;
    for (int k = 0; k < repeat; ++k) values.insert(values.end(), given, given + count);
    given += count;
    const bool finite =
        std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
    const std::string problem =
        finite ? range_problem(parameter.range, values, cable_count) : "must be finite";
    if (!problem.empty()) fail(effect, parameter.name + " " + problem);
    out.values.insert(out.values.end(), values.begin(), values.end());
  }
  return out;
}

InjectedEffect as_injected(const AppliedEffect& known, const OwnEffects& own) {
  const InjectableEffect effect = find(known.name, own);
  if (effect.of_file != nullptr) return {known.name, effect.of_file(known)};
  InjectedEffect injected{known.name, {}};
  for (const AppliedEffect::Parameter& given : known.parameters) {
    injected.values.insert(injected.values.end(), given.values.begin(), given.values.end());
  }
  return injected;
}

}  // namespace cdprcal
