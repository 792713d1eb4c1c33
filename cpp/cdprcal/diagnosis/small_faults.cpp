#include "cdprcal/diagnosis/small_faults.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cdprcal/diagnosis/motion.hpp"

namespace cdprcal {
namespace {

/// A fault that makes the fit worse by more than this hides behind no effect [nats].
constexpr double kHopeless = 10.0;

/// By how much a cost that is higher by `worse` at the least lowers the likelihood where the noise
/// is what is left [nat]: all of it may be of the channel that has the least freedom.
double lost_with_noise(double worse, const NoiseLevels& freedom) {
  double least = std::numeric_limits<double>::infinity();
  for (const double f : freedom) {
    if (f >= 1.0) least = std::min(least, f);
  }
  return 0.5 * least * std::log1p(2.0 * std::max(0.0, worse) / least);
}

}  // namespace

bool does_all(const Effect& effect) {
  return effect.info().all_or_nothing && !effect.moves_cables();
}

Candidates beside_faults(const DiagnosisModel& model) {
  Candidates out = untried(model);
  std::erase_if(out, [](const auto& effect) { return does_all(*effect); });
  return out;
}

Unfaulted::WithBest Unfaulted::with_best(const DiagnosisModel& model) const {
  constexpr int kFewRefits = 3;
  const std::vector<CandidateScore> scores = scan(model, beside_, {.draws = 0});
  const auto likely = [](const CandidateScore& s) { return s.log_evidence > 0.0; };
  for (Refit& refit : EvidenceAgainst(model).refits(scores, kFewRefits, likely)) {
    if (!(refit.log_evidence > 0.0)) break;
    if (!plausible(refit.model.effects.back(), model)) continue;
    return {std::move(refit.model), refit.log_evidence};
  }
  return {model, 0.0};
}

const Unfaulted::WithBest& Unfaulted::with_best() {
  if (!with_best_) with_best_ = with_best(model_);
  return *with_best_;
}

SmallFaults::SmallFaults(const DiagnosisModel& model)
    : given_(model.robot),
      faults_(attitude_faults(model.robot, log_of(model.runs.front().measurements))) {}

void SmallFaults::exchange(const DiscreteFault& fault, Robot& robot, Log& log) const {
  if (taken_ && !taken_->convention) set_right(*taken_, robot, log);  // signs: there and back
  robot.euler_convention = given_.euler_convention;
  set_right(fault, robot, log);
}

DiagnosisModel SmallFaults::exchanged(const DiscreteFault& fault,
                                      const DiagnosisModel& model) const {
  DiagnosisModel out = model;
  for (DiagnosisRun& run : out.runs) {
    Log readings = log_of(run.measurements);
    exchange(fault, out.robot, readings);
    take_readings(readings, run.measurements);
    run.offsets =
        offsets_at(with_effects(out.robot, run.known), run.poses.front(), run.measurements.front());
  }
  return out;
}

std::optional<FaultRefit> SmallFaults::best(Unfaulted& without, double rival_nats) const {
  const DiagnosisModel& model = without.model();
  // Single samples in motion share their errors with their neighbours: taken for independent, they
  // tell orders apart that they cannot know. Moments that balance are thinned out to independence.
  const auto& read = model.runs.front().measurements;
  if (!balances_in_motion(model) &&
      std::ranges::count_if(read, is_moving) > static_cast<std::ptrdiff_t>(read.size()) / 2) {
    return std::nullopt;
  }
  const EvidenceAgainst against(model);
  const NoiseLevels freedom = channel_sums(model).freedom;
  const double cost = penalised_cost(model);
  std::vector<std::pair<std::string, double>> tried;
  std::optional<FaultRefit> best;
  for (const DiscreteFault& fault : faults_) {
    if (taken_ && taken_->name == fault.name && taken_->values == fault.values) continue;
    FaultRefit trial{fault, exchanged(fault, model), {}, {}};
    // Most are far off, and need not be fitted with every noise to see that.
    constexpr double kSure = 3.0;
    fit(trial.model);
    if (lost_with_noise(penalised_cost(trial.model) - cost, freedom) > kSure * kHopeless) continue;
    if (!fit_with_noise(trial.model)) continue;
    const double alone = against.of(trial.model);
    if (alone < -kHopeless) continue;
    Unfaulted::WithBest with = without.with_best(trial.model);
    trial.fault.log_evidence = without.evidence_for(alone, with);
    trial.log_posterior =
        trial.fault.log_evidence + std::log(fault.prior / (taken_ ? taken_->prior : 1.0));
    tried.emplace_back(fault.text, trial.log_posterior);
    if (best && trial.log_posterior <= best->log_posterior) continue;
    trial.judged_without = without.with_best().model;
    trial.judged_with = std::move(with.model);
    best = std::move(trial);
  }
  std::string rivals;
  for (const auto& [text, log_posterior] : tried) {
    if (text == best->fault.text || log_posterior < best->log_posterior - rival_nats) continue;
    rivals += (rivals.empty() ? "; it could as well be that " : ", or ") + text;
  }
  if (best) best->fault.text += rivals;
  return best;
}

void SmallFaults::take(const DiscreteFault& fault, std::vector<Log>& logs) {
  for (Log& log : logs) {
    Robot scratch = given_;
    exchange(fault, scratch, log);
  }
  taken_ = fault;
}

}  // namespace cdprcal
