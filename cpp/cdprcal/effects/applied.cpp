#include "cdprcal/effects/applied.hpp"

#include <algorithm>

#include "cdprcal/effects/catalogue.hpp"
#include "cdprcal/effects/reading_faults.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/readings/run.hpp"

namespace cdprcal {
namespace {

constexpr const char* kSlashes = "/\\";

/// Whether `run` is the log's name: its last components, whole.
bool belongs_to(const AppliedEffect& effect, const std::string& log_source) {
  const std::string& run = effect.run;
  if (run.empty() || run == log_source) return true;
  if (run.size() >= log_source.size() || !log_source.ends_with(run)) return false;
  const char before = log_source[log_source.size() - run.size() - 1];
  return before == kSlashes[0] || before == kSlashes[1];
}

/// The last `count` components of a path.
std::string tail_of(const std::string& path, int count) {
  auto begin = path.size();
  for (; count > 0 && begin != std::string::npos && begin > 0; --count) {
    begin = path.find_last_of(kSlashes, begin - 1);
  }
  return begin == std::string::npos ? path : count > 0 ? path : path.substr(begin + 1);
}

bool of_load_cells(const ActiveEffect& active) { return active.effect->info().of_load_cells; }

}  // namespace

std::vector<std::string> run_names(const std::vector<std::string>& log_sources) {
  std::vector<std::string> names;
  for (const std::string& source : log_sources) {
    std::string name;
    for (int count = 1; name != source; ++count) {
      name = tail_of(source, count);
      const auto same = std::count_if(
          log_sources.begin(), log_sources.end(),
          [&](const std::string& other) { return belongs_to({"", name, {}}, other); });
      if (same <= 1) break;
    }
    names.push_back(std::move(name));
  }
  return names;
}

ActiveEffect resolve_effect(const Robot& robot, const AppliedEffect& applied) {
  const int cables = robot.cable_count();
  ActiveEffect active{find_effect(robot, applied.name), EffectValues(0)};
  for (const EffectParameter& parameter : active.effect->info().parameters) {
    for (const AppliedEffect::Parameter& given : applied.parameters) {
      if (given.name != parameter.name) continue;
      const Eigen::Index before = active.values.size();
      const auto count = static_cast<Eigen::Index>(given.values.size());
      active.values.conservativeResize(before + count);
      active.values.tail(count) = Eigen::Map<const EffectValues>(given.values.data(), count);
    }
  }
  if (active.values.size() != active.effect->size(cables)) {
    throw InputError("effects: " + applied.name + " has " + std::to_string(active.values.size()) +
                     " values; a robot with " + std::to_string(cables) + " cables needs " +
                     std::to_string(active.effect->size(cables)));
  }
  active.values = active.effect->from_reported(active.values);
  return active;
}

ActiveEffects resolve_effects(const Robot& robot, const std::string& log_source) {
  ActiveEffects active;
  for (const AppliedEffect& applied : robot.effects) {
    if (is_reading_fault(applied.name) || !belongs_to(applied, log_source)) continue;
    active.push_back(resolve_effect(robot, applied));
  }
  return active;
}

std::optional<Log> correct_readings(const Robot& robot, const Log& log) {
  std::optional<Log> corrected;
  for (const AppliedEffect& applied : robot.effects) {
    if (!is_reading_fault(applied.name) || !belongs_to(applied, log.source)) continue;
    check_belongs(robot, log);
    if (!corrected) corrected = log;
    set_right(applied, robot, *corrected);
  }
  return corrected;
}

CableVector true_tension_N(const Robot& robot, const ActiveEffects& effects, const Measurement& m) {
  if (m.tension_N.size() != robot.cable_count()) return m.tension_N;  // not read
  PlatformState nowhere;  // load cells do not ask where the platform is
  nowhere.cable_count = robot.cable_count();
  const Pose origin;
  CableVector tension_N = m.tension_N;
  for (const ActiveEffect& active : effects) {
    if (!of_load_cells(active)) continue;
    active.effect->correct_tension({robot, nowhere, origin, m}, active.values, tension_N);
  }
  return tension_N;
}

CableVector true_tension_by_reading(const Robot& robot, const ActiveEffects& effects,
                                    const Measurement& m) {
  if (std::none_of(effects.begin(), effects.end(), &of_load_cells)) {
    return CableVector::Ones(robot.cable_count());
  }
  // Corrections are straight lines in the reading: any step will do.
  Measurement next = m;
  next.tension_N.array() += 1.0;
  return true_tension_N(robot, effects, next) - true_tension_N(robot, effects, m);
}

KnownState with_known_effects(const Robot& robot, const Log& log) {
  const ActiveEffects effects = resolve_effects(robot, log.source);
  KnownState out{with_effects(robot, effects), correct_readings(robot, log).value_or(log)};
  out.robot.effects.clear();
  if (out.log.tension_N.cols() != robot.cable_count()) return out;
  if (std::none_of(effects.begin(), effects.end(), &of_load_cells)) return out;
  const SampleRange run = segments(log).empty() ? SampleRange{} : segments(log).back();
  const double start_s = run.size() > 0 ? log.time_s[run.begin] : 0.0;
  for (Eigen::Index row = 0; row < out.log.tension_N.rows(); ++row) {
    Measurement m;
    m.tension_N = out.log.tension_N.row(row).transpose();
    m.run_time_s = log.time_s[row] - start_s;
    out.log.tension_N.row(row) = true_tension_N(robot, effects, m).transpose();
  }
  return out;
}

AppliedEffect applied_effect(const Effect& effect, const EffectValues& reported, int cables) {
  AppliedEffect applied{effect.name(), "", {}};
  Eigen::Index begin = 0;
  for (const EffectParameter& parameter : effect.info().parameters) {
    const int count = entries(parameter.shape, cables);
    if (begin + count > reported.size()) break;
    const double* values = reported.data() + begin;
    applied.parameters.push_back({parameter.name, {values, values + count}});
    begin += count;
  }
  return applied;
}

}  // namespace cdprcal
