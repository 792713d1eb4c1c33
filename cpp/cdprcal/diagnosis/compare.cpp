#include "cdprcal/diagnosis/compare.hpp"

#include <algorithm>

#include "cdprcal/effects/applied.hpp"
#include "cdprcal/effects/of_each_log.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/evidence/steps.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal {
namespace {

/// The logs whose number is known, and the weighted mean of some of them.
struct Mean {
  double sum = 0.0, weight = 0.0;
  void add(double value, double deviation) {
    if (!std::isfinite(value) || !(deviation > 0.0)) return;
    sum += value / (deviation * deviation);
    weight += 1.0 / (deviation * deviation);
  }
  [[nodiscard]] double value() const { return sum / weight; }
};

/// χ² of the logs against their mean, and the one step that lowers it most.
void weigh(ComparedNumber& number) {
  const Eigen::Index logs = number.values.size();
  const auto chi_square = [&](Eigen::Index begin, Eigen::Index end, Mean& mean) {
    for (Eigen::Index i = begin; i < end; ++i)
      mean.add(number.values[i], number.standard_deviation[i]);
    double sum = 0.0;
    for (Eigen::Index i = begin; i < end; ++i) {
      const double off = (number.values[i] - mean.value()) / number.standard_deviation[i];
      if (std::isfinite(off)) sum += off * off;
    }
    return sum;
  };
  Mean all;
  number.chi_square = chi_square(0, logs, all);
  double least = HUGE_VAL;
  for (Eigen::Index k = 1; k < logs; ++k) {
    Mean before, after;
    const double left = chi_square(0, k, before) + chi_square(k, logs, after);
    if (!(before.weight > 0.0) || !(after.weight > 0.0) || !(left < least)) continue;
    least = left;
    number.from_log = static_cast<int>(k) + 1;
    number.step = after.value() - before.value();
    number.step_deviation = std::sqrt(1.0 / after.weight + 1.0 / before.weight);
  }
}

/// Each effect that some of the diagnoses found, once; formulas apart. Of two that the poses do not
/// tell apart the first stands for both: together their values would be anything.
void collect(const Diagnosis& found, Candidates& effects, std::vector<DiscreteFault>& faults) {
  for (const NamedEffect& effect : found.effects) {
    if (as_step(*effect.effect) || effect.effect->needs_motion()) continue;
    const auto same = [&](const auto& other) {
      return other->name() == effect.effect->name() ||
             std::ranges::find(effect.rivals, other->name()) != effect.rivals.end();
    };
    if (std::ranges::none_of(effects, same)) effects.push_back(of_all_logs(effect.effect));
  }
  for (const DiscreteFault& fault : found.faults) {
    const auto same = [&](const DiscreteFault& other) { return other.text == fault.text; };
    if (std::ranges::none_of(faults, same)) faults.push_back(fault);
  }
}

}  // namespace

Comparison compare(const Robot& given, const std::vector<Log>& logs,
                   const DiagnoseOptions& options) {
  if (logs.size() < 2) throw InputError("compare: needs two logs at least; give another");
  Comparison out;
  std::vector<std::string> sources;
  for (const Log& log : logs) sources.push_back(log.source);
  out.logs = run_names(sources);
  const auto report = [&](const std::string& what) {
    out.complete = out.complete && (!options.progress || options.progress(what));
    return out.complete;
  };
  Candidates effects;
  report("all logs together");
  collect(diagnose(given, logs, options), effects, out.faults);
  for (std::size_t i = 0; i < logs.size() && report(out.logs[i] + " alone"); ++i) {
    collect(diagnose(given, {logs[i]}, options), effects, out.faults);
  }
  Robot robot = given;
  DiagnoseOptions chosen = options;
  chosen.faults = out.faults;
  chosen.effects.emplace();
  for (const auto& effect : effects) {
    chosen.effects->push_back(effect->name());
    const auto known = effects_of(robot);
    if (std::ranges::find(known, effect) == known.end()) robot.own_effects.push_back(effect);
  }
  const auto count = static_cast<Eigen::Index>(logs.size());
  for (const auto& effect : effects) {
    const auto& parameters = effect->info().parameters;
    for (std::size_t p = 0; p < parameters.size(); ++p) {
      for (int e = 0; e < entries(parameters[p].shape, robot.cable_count()); ++e) {
        ComparedNumber number{effect, static_cast<int>(p), e, {}, {}};
        number.values = number.standard_deviation = Eigen::VectorXd::Constant(count, kNaN);
        out.numbers.push_back(std::move(number));
      }
    }
  }
  for (std::size_t i = 0; i < logs.size(); ++i) {
    report("fitting " + out.logs[i]);
    const Diagnosis fit = diagnose(robot, {logs[i]}, chosen);
    out.initial_pose.push_back(fit.initial_pose_after);
    out.covariance.push_back(fit.covariance_after);
    if (fit.effects.size() < effects.size()) out.not_settled.push_back(out.logs[i]);
    for (const NamedEffect& effect : fit.effects) {
      Eigen::Index next = 0;
      for (ComparedNumber& number : out.numbers) {
        if (number.effect->name() != effect.effect->name()) continue;
        number.values[static_cast<Eigen::Index>(i)] = effect.values[next];
        number.standard_deviation[static_cast<Eigen::Index>(i)] = effect.standard_deviation[next];
        ++next;
      }
    }
  }
  for (ComparedNumber& number : out.numbers) {
    weigh(number);
    const auto known = static_cast<double>(number.values.array().isFinite().count());
    const double alone = chi_square_survival(number.chi_square, known - 1.0);
    number.p_value = std::min(1.0, alone * static_cast<double>(out.numbers.size()));
    number.moved = number.p_value < options.family_wise_p;
  }
  return out;
}

}  // namespace cdprcal
