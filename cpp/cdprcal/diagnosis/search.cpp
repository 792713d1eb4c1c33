#include "cdprcal/diagnosis/search.hpp"

#include <algorithm>
#include <map>

#include "cdprcal/diagnosis/formulas.hpp"
#include "cdprcal/diagnosis/motion.hpp"
#include "cdprcal/diagnosis/quiet.hpp"
#include "cdprcal/diagnosis/sensor_errors.hpp"
#include "cdprcal/diagnosis/separation.hpp"
#include "cdprcal/effects/of_each_log.hpp"
#include "cdprcal/effects/text_effect.hpp"
#include "cdprcal/estimation/presence.hpp"
#include "cdprcal/evidence/checks.hpp"
#include "cdprcal/evidence/directions.hpp"
#include "cdprcal/evidence/steps.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

/// Named effects that a dependence is weighed against together.
constexpr int kMostTogether = 3;
/// Evidence for what a name leaves, as a share of its own, up to which the name stands.
constexpr double kRemainder = 0.1;
/// Who shares the chance of a false alarm besides the names that rests show: those that motion
/// shows, and dependences without a name.
constexpr double kShareInMotion = 0.2, kShareOfDependences = 0.2;
constexpr double kNamedShare = kShareAtRest + kShareInMotion;
/// Chance that a formula for what is left is one of noise.
constexpr double kChanceOfForm = 0.05;
/// What is to be more than one odd rest: so many standard errors of a gain.
constexpr double kOutweighs = 2.0;
/// What happened once shows in some number by so many σ.
constexpr double kSeen = 3.0;
constexpr const char* kNotSeen = "none of its numbers is known to be there at all";
/// Candidates refitted where the best of several is not much better known than the next.
constexpr int kFewRefits = 3;

/// Whether an effect is no step, or some number of it is known to be there: whatever sides cables
/// and swivels came from before power-on, too, which stirs one rest as a step may.
bool is_seen(const DiagnosisModel& model, std::size_t k) {
  if (!as_step(*model.effects[k].effect)) return true;
  const EffectValues& values = model.effects[k].values;
  const Eigen::VectorXd variance = covariance(model).diagonal().tail(model.values().size()) +
                                   uncertain_directions(model).variance;
  const Eigen::VectorXd own = variance.segment(values_begin(model, k), values.size());
  return (values.array().abs() > kSeen * own.array().sqrt()).any();
}

bool wanders(const EffectTerm& term) { return is_wandering_errors(*term.effect); }

bool is_named(const CandidateScore& score) { return !generic_name(*score.effect); }

/// The best refit of the first few dependences; nothing when none is worth it.
std::optional<Refit> best_generic(const EvidenceAgainst& against,
                                  const std::vector<CandidateScore>& scores, double least) {
  std::vector<Refit> refits = against.refits(scores, kFewRefits, [&](const CandidateScore& s) {
    return !is_named(s) && s.log_evidence > least;
  });
  if (refits.empty()) return std::nullopt;
  return std::move(refits.front());
}

/// Those of some refits that add something to errors of the sensors, best first: judged together
/// with these, which would swallow an effect if they were in the model before it.
std::vector<Refit> beside_sensor_errors(std::vector<Refit> refits, const Refit& errors,
                                        double least) {
  std::vector<std::pair<double, Refit>> kept;
  for (Refit& refit : refits) {
    DiagnosisModel start = refit.model;
    start.noise = errors.model.noise;
    const double with = EvidenceAgainst(refit.model)
                            .refit(std::move(start), errors.model.effects.back())
                            .log_evidence;
    const double together = refit.log_evidence + std::max(0.0, with);
    if (together > errors.log_evidence + least) kept.emplace_back(together, std::move(refit));
  }
  std::ranges::stable_sort(kept, std::ranges::greater(), &std::pair<double, Refit>::first);
  refits.clear();
  for (auto& [together, refit] : kept) refits.push_back(std::move(refit));
  return refits;
}

/// Evidence for named effects with the noise at its floor, where that is more: an effect that fills
/// a channel passes for noise in it, and under such noise the prior holds its value back.
void look_below_the_noise(const DiagnosisModel& model, const Candidates& named,
                          std::vector<CandidateScore>& scores) {
  DiagnosisModel quiet = model;
  quiet.noise = quiet.floor;
  for (const CandidateScore& sharp : scan(quiet, named, {.draws = 0})) {
    const auto same = std::find_if(scores.begin(), scores.end(), [&](const CandidateScore& s) {
      return s.effect == sharp.effect;
    });
    if (same == scores.end() || !(sharp.log_evidence > same->log_evidence)) continue;
    same->log_evidence = sharp.log_evidence;
    same->values = sharp.values;
  }
  std::stable_sort(scores.begin(), scores.end(),
                   [](const auto& a, const auto& b) { return a.log_evidence > b.log_evidence; });
}

/// The likeliest step of each kind: which of them it is shows only once it is fitted. There are as
/// many as moves and cables.
std::vector<CandidateScore> best_steps(const DiagnosisModel& model, const Candidates& steps) {
  constexpr std::size_t kAtATime = 64;
  std::map<std::string, CandidateScore> best;
  scan_in_parts(model, steps, kAtATime, [&](CandidateScore&& score) {
    const auto [of_kind, first] = best.try_emplace(score.effect->info().name, score);
    if (!first && score.log_evidence > of_kind->second.log_evidence) {
      of_kind->second = std::move(score);
    }
  });
  std::vector<CandidateScore> out;
  for (auto& [name, score] : best) out.push_back(std::move(score));
  return out;
}

/// Family-wise p-values, drawn when first asked for: far above chance nothing need be drawn.
class PValues {
 public:
  PValues(const DiagnosisModel& model, const Candidates& candidates, const ScanOptions& options)
      : model_(model), candidates_(candidates), options_(options) {}
  [[nodiscard]] double of(const CandidateScore& score) const {
    if (beyond_chance(score, candidates_.size(), options_.draws)) {
      return 1.0 / (1.0 + options_.draws);
    }
    if (drawn_.empty()) drawn_ = scan(model_, candidates_, options_);
    for (const CandidateScore& s : drawn_) {
      if (s.effect == score.effect) return s.p_value;
    }
    return 1.0;
  }

 private:
  const DiagnosisModel& model_;
  const Candidates& candidates_;
  const ScanOptions& options_;
  mutable std::vector<CandidateScore> drawn_;
};

/// The likeliest formulas for what a model leaves, refitted, best first. Their prior is in their
/// evidence. `noise`: the same model with errors that count as noise; a formula has to explain more
/// than chance beside them, too.
std::vector<Refit> refitted_formulas(const DiagnosisModel& model, std::size_t count,
                                     const DiagnosisModel* noise = nullptr,
                                     double most_chance = 1.0) {
  const EvidenceAgainst against(model);
  const auto sure_beside_noise = [&](const LikelyFormula& likely) {
    const double beside = EvidenceAgainst(*noise).refit(likely.score).log_evidence;
    return chance_at_most(beside + likely.log_prior) < most_chance;
  };
  std::vector<Refit> refits;
  for (const LikelyFormula& likely : likely_formulas(model, count)) {
    if (!(likely.score.log_evidence + likely.log_prior > 0.0)) continue;
    Refit refit = against.refit(likely.score);
    if (refit.model.effects.size() == model.effects.size()) continue;  // it does not settle
    if (noise && !sure_beside_noise(likely)) continue;
    // Among so many the best is worth as much less.
    refit.log_evidence += likely.log_prior;
    refit.score.p_value = chance_at_most(refit.log_evidence);
    refits.push_back(std::move(refit));
  }
  std::ranges::stable_sort(refits, std::ranges::greater(), &Refit::log_evidence);
  return refits;
}

/// Why a name is none where smooth errors have more.
std::string stands_for(const Refit& errors) {
  return printed("%s, as the sensors may have them, explain more (%.1f nats)",
                 words_of_smooth(*errors.model.effects.back().effect).c_str(), errors.log_evidence);
}

constexpr const char* kNothingLeft = ", and nothing is left for it";
/// Why an effect of this evidence is none where a formula has more, or cannot be told from it.
std::string stands_in(const Refit& formula, double own_nats) {
  return printed(
      formula.log_evidence > own_nats
          ? "only stood in for a law that no effect has: %s explains the readings better "
            "(%.1f nats against %.1f)"
          : "cannot be told from a law that no effect has: %s (%.1f nats against %.1f)",
      formula.score.effect->info().equation, formula.log_evidence, own_nats);
}

}  // namespace

void record_gap(const DiagnosisModel& before, const DiagnosisModel& model,
                const std::string& after_effect, Diagnosis& out) {
  const HeldOut held = held_out(before, model);
  for (std::size_t c = 0; c < kRestGroups; ++c) {
    if (!std::isfinite(held.held_out_rms[c])) continue;
    if (static_cast<Channel>(c) == Channel::balance &&
        !reads_tensions(model.runs.front().measurements))
      continue;
    out.gap.push_back(
        {after_effect, kChannelTable[c].rms_field, held.train_rms[c], held.held_out_rms[c]});
  }
}

Search::Search(std::vector<Log>& logs, DiagnosisModel& model, Diagnosis& out,
               const DiagnoseOptions& options)
    : logs_(logs), model_(model), out_(out), options_(options), small_faults_(model) {}

bool Search::found_what_does_all() const {
  return std::ranges::any_of(out_.effects,
                             [](const NamedEffect& found) { return does_all(*found.effect); });
}

bool Search::report(const std::string& what) const {
  return !options_.progress || options_.progress(what);
}

Candidates Search::names_for(const DiagnosisModel& model) const {
  Candidates out = without_all_ ? beside_faults(model) : untried(model);
  if (model.runs.size() < 2) return out;
  for (std::size_t k = 0, all = out.size(); k < all; ++k) {
    if (auto own = of_each_log(out[k])) out.push_back(std::move(own));
  }
  return out;
}

double Search::cost_of(const Effect& effect, std::size_t steps) const {
  if (as_step(effect)) return std::log(std::max<double>(1.0, static_cast<double>(steps)));
  if (sensor_of_errors(effect)) return std::log(sensors_with_like(model_));
  return is_of_each_log(effect) ? options_.rival_nats : 0.0;
}

void Search::charge(std::vector<Refit>& refits, std::size_t steps) const {
  for (Refit& refit : refits) refit.log_evidence -= cost_of(*refit.score.effect, steps);
  std::ranges::stable_sort(refits, std::ranges::greater(), &Refit::log_evidence);
}

std::optional<Refit> Search::errors_of_sensors(double log_evidence) const {
  constexpr double kShareInScan = 0.25;  // of the evidence: a scan knows no width but the first
  Candidates errors = own_errors(model_);
  if (std::ranges::none_of(model_.effects, wanders)) {
    if (const auto walk = wandering_errors(model_, ErrorSize::specified)) errors.push_back(walk);
  }
  std::vector<CandidateScore> scores = scan(model_, errors, {.draws = 0});
  for (CandidateScore& s : scores) s.log_evidence -= cost_of(*s.effect, 0);
  std::ranges::stable_sort(scores, std::ranges::greater(), &CandidateScore::log_evidence);
  std::vector<Refit> refits =
      EvidenceAgainst(model_).refits(scores, kFewRefits, [&](const CandidateScore& s) {
        const double share = sensor_of_errors(*s.effect) ? kShareInScan : 1.0;
        return s.log_evidence > share * log_evidence;
      });
  charge(refits);
  if (refits.empty() || !(refits.front().log_evidence > log_evidence)) return std::nullopt;
  return std::move(refits.front());
}

bool Search::names_reach(double log_evidence, const Refit& first) const {
  double total = first.log_evidence;
  DiagnosisModel model = first.model;
  for (int k = 1; k < kMostTogether && total + options_.rival_nats < log_evidence; ++k) {
    const std::vector<CandidateScore> scores = scan(model, untried(model), {.draws = 0});
    const EvidenceAgainst against(model);
    std::vector<Refit> refits = against.refits(scores, kFewRefits, [&](const CandidateScore& s) {
      return s.log_evidence > options_.least_evidence;
    });
    std::erase_if(refits, [&](const Refit& r) {
      return r.log_evidence <= options_.least_evidence || !plausible(r.model.effects.back(), model);
    });
    if (refits.empty()) return false;
    total += refits.front().log_evidence;
    model = std::move(refits.front().model);
  }
  return total + options_.rival_nats >= log_evidence;
}

std::string Search::objection(const Refit& candidate, const Refit* generic, double least_p,
                              HeldOut& held) const {
  if (candidate.score.p_value >= least_p) {
    return printed("chance does as well (family-wise p = %.3f)", candidate.score.p_value);
  }
  if (candidate.log_evidence <= -1e299) return "the fit with it does not settle";
  if (candidate.log_evidence <= options_.least_evidence) {
    return printed("evidence %.1f nats after the refit, %.1f needed", candidate.log_evidence,
                   options_.least_evidence);
  }
  if (!plausible(candidate.model.effects.back(), model_)) {
    return "the value it would need is physically implausible";
  }
  if (!is_seen(candidate.model, candidate.model.effects.size() - 1)) return kNotSeen;
  for (const EffectTerm& known : model_.effects) {
    for (const EffectTerm& now : candidate.model.effects) {
      if (now.effect != known.effect || !plausible(known, model_)) continue;
      if (plausible(now, model_)) continue;
      return "the value that " + now.effect->name() +
             " would need beside it is physically implausible";
    }
  }
  held = held_out(model_, candidate.model);
  const std::optional<Step> step = as_step(*candidate.score.effect);
  // Of what parts a rest from them the others tell nothing: it must not spoil them.
  const double least_gain = step && step->parts_a_rest ? -held.gain_error : held.gain_error;
  if (!(held.gain > least_gain)) {
    return printed("does not predict poses it was not fitted on (gain %.1f +- %.1f nats)",
                   held.gain, held.gain_error);
  }
  if (step && step->parts_a_rest) {
    const std::optional<DiagnosisModel> late = with_late_first_rests(model_, logs_);
    if (late &&
        !(EvidenceAgainst(*late).refit(candidate.score).log_evidence > options_.least_evidence)) {
      return "what it explains fades while the platform rests";
    }
  }
  if (looks_at_directions(*candidate.score.effect, model_)) {
    const std::optional<DiagnosisModel> along_motion = with_followed_directions(model_, logs_);
    if (along_motion && !(EvidenceAgainst(*along_motion).refit(candidate.score).log_evidence >
                          options_.least_evidence)) {
      return "follows the errors of the readings and not the motion of the platform";
    }
  }
  if (generic != nullptr && candidate.log_evidence + options_.rival_nats < generic->log_evidence &&
      !names_reach(generic->log_evidence, candidate)) {
    const GenericName what = *generic_name(*generic->score.effect);
    return printed(
        "a mere dependence of %s on %s explains the readings better (%.1f nats against "
        "%.1f)",
        what.channel.c_str(), what.depends_on.c_str(), generic->log_evidence,
        candidate.log_evidence);
  }
  return "";
}

void Search::accept(Refit& winner, const HeldOut& held) {
  NamedEffect found;
  found.effect = winner.score.effect;
  found.log_evidence = winner.log_evidence;
  found.p_value = winner.score.p_value;
  found.held_out_before = held.before;
  found.held_out_after = held.after;
  if (const std::optional<Step> step = as_step(*found.effect)) {
    found.where = {{"time_s", step->time_s}};
    if (step->cable) found.where.emplace_back("cable", *step->cable + 1.0);
  }
  smooth_noise_.reset();  // of a model without it
  const DiagnosisModel before = std::move(model_);
  model_ = std::move(winner.model);
  const auto errors = model_.effects.begin() + static_cast<std::ptrdiff_t>(out_.effects.size());
  std::rotate(errors, model_.effects.end() - 1, model_.effects.end());
  if (found.effect->info().of_swivel_play) refine_swivel_play(model_, logs_);
  record_gap(before, model_, found.effect->name(), out_);
  out_.effects.push_back(std::move(found));
}

bool Search::accept_fault(const FaultRefit& found) {
  if (!small_faults_.taken()) {
    const HeldOut held = held_out(found.judged_without, found.judged_with);
    if (!(held.gain > held.gain_error)) return false;
    record_gap(model_, found.model, found.fault.name, out_);
  }
  // A convention is one of several: the right one stands in the place of any that was found before.
  std::erase_if(out_.faults, [&](const DiscreteFault& f) {
    return (small_faults_.taken() && f.text == small_faults_.taken()->text) ||
           (f.convention && found.fault.convention);
  });
  small_faults_.take(found.fault, logs_);
  model_ = found.model;
  out_.faults.push_back(found.fault);
  return true;
}

bool Search::look_for_fault() {
  if (small_faults_.taken()) return false;
  Unfaulted without(model_);
  const std::optional<FaultRefit> found = small_faults_.best(without, options_.rival_nats);
  if (!is_sure_of(found)) return false;
  if (std::string reason = stands_for_a_law(*found); !reason.empty()) {
    out_.rejected.push_back({found->fault.name, std::move(reason)});
    return false;
  }
  return accept_fault(*found);
}

bool Search::is_sure_of(const std::optional<FaultRefit>& found) const {
  // The posterior bears the number of faults already, by their priors.
  return found && found->log_posterior > options_.least_evidence &&
         chance_at_most(found->log_posterior) < kNamedShare * options_.family_wise_p;
}

std::string Search::stands_for_a_law(const FaultRefit& found) const {
  for (const Refit& law : refitted_formulas(found.judged_without, kFewRefits)) {
    if (law.log_evidence < found.log_posterior) break;
    Unfaulted without(law.model);
    if (is_sure_of(small_faults_.best(without, options_.rival_nats))) continue;
    return stands_in(law, found.log_posterior) + kNothingLeft;
  }
  return "";
}

bool Search::exchange_fault() {
  if (!small_faults_.taken()) return false;
  Unfaulted without(model_);
  const std::optional<FaultRefit> other = small_faults_.best(without, options_.rival_nats);
  // One that cannot be told apart from the accepted one is its rival, not its better.
  return other && other->log_posterior > options_.rival_nats && accept_fault(*other);
}

bool Search::is_sure(const DiagnosisModel& model, const std::optional<Refit>& dependence,
                     const Candidates& generic) const {
  const double least_p = kShareOfDependences * options_.family_wise_p;
  // A scan's evidence is a hint, a refit's the fact: only what outlasts it is left.
  if (!dependence || !(dependence->log_evidence > options_.least_evidence)) return false;
  // The refit may know more than the scan whose chance is drawn.
  return chance_at_most(dependence->log_evidence, generic.size()) < least_p ||
         PValues(model, generic, options_.scan).of(dependence->score) < least_p;
}

void Search::keep_left(const std::optional<Refit>& dependence, const Candidates& generic) {
  left_.reset();
  if (!is_sure(model_, dependence, generic)) return;
  // It may be of the readings' own noise: it is left where it is sure without that, too.
  const DiagnosisModel quiet = with_quiet_covariates(model_, logs_);
  const Candidates laws = generic_candidates(quiet);
  const std::optional<Refit> best = best_generic(
      EvidenceAgainst(quiet), scan(quiet, laws, {.draws = 0}), options_.least_evidence);
  if (is_sure(quiet, best, laws)) left_ = best->score;
}

double Search::nats_of_name(double log_evidence) const {
  return log_evidence - std::log(static_cast<double>(effects_of(model_.robot).size()));
}

void Search::take_back(std::size_t k, const DiagnosisModel& without, const std::string& reason) {
  out_.rejected.push_back({model_.effects[k].effect->name(), reason});
  out_.effects.erase(out_.effects.begin() + static_cast<std::ptrdiff_t>(k));
  model_ = without;
}

void Search::withdraw_stand_ins() {
  for (std::size_t k = 0; k < out_.effects.size() && scatters(model_);) {
    const EffectTerm& name = model_.effects[k];
    const std::optional<DiagnosisModel> without = without_effect(model_, k);
    // What a person wrote down is no stand-in.
    if (as_step(*name.effect) || definition_of(*name.effect) || !without) {
      ++k;
      continue;
    }
    const std::vector<Refit> refits = refitted_formulas(*without, 2);
    const CandidateScore again = as_candidate(name);
    const EvidenceAgainst against(*without);
    const double own = nats_of_name(against.refit(again).log_evidence);
    const bool beaten = !refits.empty() && refits.front().log_evidence > own + options_.rival_nats;
    if (!beaten ||
        EvidenceAgainst(refits.front().model).refit(again).log_evidence > options_.least_evidence) {
      ++k;
      continue;
    }
    take_back(k, *without, stands_in(refits.front(), own) + kNothingLeft);
  }
}

void Search::describe() {
  constexpr int kMostTerms = 3;
  constexpr std::size_t kTried = 8;
  withdraw_stand_ins();
  const double chance = kShareOfDependences * options_.family_wise_p;
  for (int term = 0; term < kMostTerms && (left_ || smooth_noise_ || scatters(model_)); ++term) {
    if (static_cast<int>(out_.effects.size()) >= options_.most_effects) return;
    if (!report("a formula for what is left")) return;
    std::vector<Refit> refits = refitted_formulas(model_, kTried, smooth_noise(), chance);
    if (refits.empty()) return;
    // Of those that are not beaten the one with the fewest numbers.
    const double best = refits.front().log_evidence;
    const auto cost = [&](const Refit& r) {
      return std::pair(r.log_evidence + options_.rival_nats < best,
                       r.model.effects.back().values.size());
    };
    Refit winner = *std::ranges::min_element(refits, {}, cost);
    HeldOut held;
    // That there is something is known where something is left: the formula says what.
    const double least_p = left_ ? kChanceOfForm : chance;
    std::string reason = objection(winner, nullptr, least_p, held);
    if (reason.empty() && !(held.gain > kOutweighs * held.gain_error)) {
      reason = printed("predicts too few poses it was not fitted on (gain %.1f +- %.1f nats)",
                       held.gain, held.gain_error);
    }
    const std::string name = winner.score.effect->name();
    if (reason.empty() &&
        !(EvidenceAgainst(with_quiet_covariates(model_, logs_)).refit(winner.score).log_evidence >
          options_.least_evidence)) {
      reason = "stands for the noise of the readings: without it little is explained";
    }
    if (!reason.empty()) {
      out_.rejected.push_back({name, reason});
      return;
    }
    EffectTerm& added = winner.model.effects.back();
    winner.score.effect = added.effect = with_meaning(winner.score.effect, added.values);
    accept(winner, held);
    out_.effects.back().described = true;
    report("accepted " + name);
    const Candidates generic = generic_candidates(model_);
    const std::vector<CandidateScore> scores = scan(model_, generic, {.draws = 0});
    keep_left(best_generic(EvidenceAgainst(model_), scores, options_.least_evidence), generic);
  }
}

std::vector<Refit> Search::jumps(const EvidenceAgainst& against, const Candidates& steps) const {
  DiagnosisModel quiet = model_;
  quiet.noise = quiet.floor;
  std::vector<CandidateScore> sharp = best_steps(quiet, steps);
  std::ranges::stable_sort(sharp, std::ranges::greater(), &CandidateScore::log_evidence);
  const auto is_likely = [&](const CandidateScore& s) {
    return s.log_evidence - cost_of(*s.effect, steps.size()) > options_.least_evidence;
  };
  std::vector<Refit> out = against.refits(sharp, kFewRefits, is_likely, quiet);
  if (out.empty()) return out;
  // What no step is needed for speaks for none.
  if (fit_with_noise(quiet)) {
    const double by_itself = std::max(0.0, against.of(quiet));
    for (Refit& refit : out) refit.log_evidence -= by_itself;
  }
  return out;
}

bool Search::accept_best(std::vector<Refit>& refits, const Refit* rival, const Chance& chance) {
  for (Refit& refit : refits) {
    HeldOut held;
    const std::string name = refit.score.effect->name();
    const bool step = as_step(*refit.score.effect).has_value();
    refit.score.p_value = step ? chance_at_most(refit.log_evidence) : chance(refit.score);
    // Of steps the chance is a bound.
    const double share = step ? kNamedShare : kShareAtRest;
    const std::string reason = objection(refit, rival, share * options_.family_wise_p, held);
    if (reason.empty()) {
      stopped_ = !report("accepted " + name);
      accept(refit, held);
      return true;
    }
    out_.rejected.push_back({name, reason});
  }
  return false;
}

bool Search::forward() {
  look_for_fault();
  for (;;) {
    const Candidates named = names_for(model_);
    const Candidates generic = generic_candidates(model_);
    Candidates all = named;
    all.insert(all.end(), generic.begin(), generic.end());
    std::vector<CandidateScore> scores = scan(model_, all, {.draws = 0});
    look_below_the_noise(model_, named, scores);
    const Candidates steps = step_candidates(model_);
    for (CandidateScore& step : best_steps(model_, steps)) scores.push_back(std::move(step));
    for (CandidateScore& s : scores) s.log_evidence -= cost_of(*s.effect, steps.size());
    std::ranges::stable_sort(scores, std::ranges::greater(), &CandidateScore::log_evidence);
    const PValues p_named(model_, named, options_.scan);
    const EvidenceAgainst against(model_);
    // One jump makes every channel scatter, which hides it from the scan: its refit shows it.
    const bool scattered = scatters(model_);
    const std::optional<Refit> rival = best_generic(against, scores, options_.least_evidence);
    keep_left(rival, generic);
    if (static_cast<int>(out_.effects.size()) >= options_.most_effects) {
      const std::string word = printed(
          "no more than %d effects were looked for; there may be others", options_.most_effects);
      if (std::ranges::find(out_.next, word) == out_.next.end()) out_.next.push_back(word);
      return true;
    }
    if (!report(printed("scan after %d effects", static_cast<int>(out_.effects.size())))) {
      return false;
    }
    std::vector<Refit> refits =
        against.refits(scores, refits_a_round(), [&](const CandidateScore& s) {
          return is_named(s) &&
                 (s.log_evidence > options_.least_evidence || (scattered && as_step(*s.effect)));
        });
    const auto charge_steps = [&](std::vector<Refit>& of) {
      charge(of, steps.size());
      std::erase_if(of, [&](const Refit& r) {
        return as_step(*r.score.effect) && !(r.log_evidence > options_.least_evidence);
      });
    };
    charge_steps(refits);
    std::optional<Refit> errors;
    if (rival || !refits.empty() || scattered) {
      double best = options_.least_evidence;
      if (rival) best = std::max(best, rival->log_evidence);
      if (!refits.empty()) best = std::max(best, refits.front().log_evidence);
      errors = errors_of_sensors(best);
      if (errors) {
        refits = beside_sensor_errors(std::move(refits), *errors, options_.least_evidence);
      }
    }
    const auto chance = [&](const CandidateScore& score) { return p_named.of(score); };
    bool accepted = accept_best(refits, rival ? &*rival : nullptr, chance);
    if (!accepted && scattered) {
      refits = jumps(against, steps);
      charge_steps(refits);
      if (errors) {
        refits = beside_sensor_errors(std::move(refits), *errors, options_.least_evidence);
      }
      accepted = accept_best(refits, rival ? &*rival : nullptr, chance);
    }
    if (stopped_) return false;
    if (accepted) {
      look_for_fault();
      continue;
    }
    if (!errors) return true;
    model_ = std::move(errors->model);  // which hides no fault: it was looked for without
  }
}

void Search::take(const Candidates& chosen) {
  for (const auto& effect : chosen) {
    const std::vector<CandidateScore> scores = scan(model_, {effect}, {.draws = 0});
    if (scores.empty()) {
      out_.rejected.push_back({effect->name(), "the model cannot be evaluated"});
      continue;
    }
    Refit refit = EvidenceAgainst(model_).refit(scores.front());
    if (refit.log_evidence <= -1e299) {
      out_.rejected.push_back({effect->name(), "the fit with it does not settle"});
      continue;
    }
    const HeldOut held = held_out(model_, refit.model);
    accept(refit, held);
    if (!report("fitted " + effect->name())) return;
  }
}

std::vector<std::string> Search::late_in_its_place(const DiagnosisModel& moving,
                                                   Refit& found) const {
  std::vector<std::string> rivals;
  if (!found.score.effect->info().of_lateness) return rivals;
  Candidates others = untried(moving, Shows::in_moving_balance);
  std::erase_if(others, [](const auto& effect) { return !effect->info().of_lateness; });
  const EvidenceAgainst against(moving);
  for (const CandidateScore& other : scan(moving, others, {.draws = 0})) {
    Refit refit = against.refit(other);
    if (refit.log_evidence > found.log_evidence + options_.rival_nats) {
      refit.score.p_value = found.score.p_value;
      found = std::move(refit);
      rivals.clear();
    } else if (refit.log_evidence > found.log_evidence - options_.rival_nats) {
      rivals.push_back(other.effect->name());
    }
  }
  return rivals;
}

void Search::in_motion() {
  if (static_cast<int>(out_.effects.size()) >= options_.most_effects) return;
  if (!report("samples in motion")) return;
  // Errors of a model last longer than noise: samples are taken so far apart that what is left at
  // one says nothing about the next.
  DiagnosisModel moving = model_;
  const MovingSamples samples = moving_samples(model_, logs_);
  for (const double spacing_s : {0.09, 0.3, 1.0, 3.0}) {
    moving = with_motion(model_, samples, {.least_spacing_s = spacing_s});
    if (moving.pose_count() == model_.pose_count() || !fit_with_noise(moving)) return;
    if (!(motion_correlation(moving) > kMostShared)) break;
  }
  const Candidates candidates = untried(moving, Shows::in_motion);
  std::vector<CandidateScore> scores = scan(moving, candidates, {.draws = 0, .limits = true});
  for (const CandidateScore& s : scores) {
    out_.identifiability.push_back({s.effect->name(), s.visible, s.detectable});
  }
  if (scores.empty() || scores.front().log_evidence <= options_.least_evidence) return;
  scores.front().p_value = PValues(moving, candidates, options_.scan).of(scores.front());
  Refit refit = EvidenceAgainst(moving).refit(scores.front());
  std::vector<std::string> rivals = late_in_its_place(moving, refit);
  HeldOut held;
  std::swap(model_, moving);  // what the refit is judged against
  const std::string name = refit.score.effect->name();
  const double least_p = kShareInMotion * options_.family_wise_p;
  std::string reason = objection(refit, nullptr, least_p, held);
  if (reason.empty()) {
    if (const auto errors = smooth_errors_instead(refit.score, model_))
      reason = stands_for(*errors);
  }
  if (reason.empty()) {
    // Few effects need motion to show: what has no name, such as the play of an encoder, may well
    // look like one of them.
    const std::vector<Refit> formulas = refitted_formulas(model_, kFewRefits);
    const double own = nats_of_name(refit.log_evidence);
    if (formulas.empty() || own > formulas.front().log_evidence + options_.rival_nats) {
      report("accepted " + name);
      accept(refit, held);
      out_.effects.back().rivals = std::move(rivals);
      return;
    }
    out_.rejected.push_back({name, stands_in(formulas.front(), own)});
    scores = scan(model_, generic_candidates(model_), {.draws = 0});  // the best first
    const bool better =
        !scores.empty() && (!left_ || scores.front().log_evidence > left_->log_evidence);
    if (better) left_ = scores.front();
    const std::size_t before = out_.effects.size();
    describe();
    if (out_.effects.size() > before) return;
  } else {
    out_.rejected.push_back({name, reason});
  }
  std::swap(model_, moving);
}

Candidates Search::confusable(const DiagnosisModel& without, const EffectTerm& term) const {
  const Candidates named = names_for(without);
  const std::vector<double> shares = imitation(without, as_candidate(term), named);
  Candidates out;
  for (std::size_t j = 0; j < named.size(); ++j) {
    if (named[j] == term.effect || shares[j] > options_.rival_share) out.push_back(named[j]);
  }
  return out;
}

bool Search::exchange() {
  bool any = false;
  for (std::size_t k = 0; k < out_.effects.size(); ++k) {
    std::optional<DiagnosisModel> without = without_effect(model_, k);
    if (!without) continue;
    const auto present = model_.effects[k].effect;
    if (as_step(*present)) continue;
    const Candidates alike = confusable(*without, model_.effects[k]);
    if (alike.size() < 2) continue;
    const std::vector<CandidateScore> scores = scan(*without, alike, {.draws = 0});
    const EvidenceAgainst against(*without);
    std::vector<Refit> refits =
        against.refits(scores, refits_a_round(), [](const CandidateScore&) { return true; });
    charge(refits);
    const auto mine = std::find_if(refits.begin(), refits.end(),
                                   [&](const Refit& r) { return r.score.effect == present; });
    if (mine == refits.begin()) continue;
    Refit& best = refits.front();
    const double own = mine != refits.end() ? mine->log_evidence : -1e300;
    if (!(best.log_evidence > own + 1e-6) || !plausible(best.model.effects.back(), model_)) {
      continue;
    }
    const HeldOut held = held_out(*without, best.model);
    if (!(held.gain > held.gain_error)) continue;
    out_.rejected.push_back(
        {present->name(), printed("with all accepted effects in the model, %s explains the "
                                  "readings better (%.1f nats against %.1f)",
                                  best.score.effect->info().name, best.log_evidence, own)});
    NamedEffect& found = out_.effects[k];
    found.effect = best.score.effect;
    found.log_evidence = best.log_evidence;
    found.held_out_before = held.before;
    found.held_out_after = held.after;
    // The newcomer takes the old one's place in the order.
    EffectTerm term = std::move(best.model.effects.back());
    best.model.effects.pop_back();
    best.model.effects.insert(best.model.effects.begin() + static_cast<std::ptrdiff_t>(k),
                              std::move(term));
    model_ = std::move(best.model);
    record_gap(*without, model_, found.effect->name(), out_);
    any = true;
  }
  return any;
}

void Search::drop() {
  // The last of all has been weighed with all others in the model.
  for (std::size_t k = 0; k < out_.effects.size() && k + 1 < model_.effects.size();) {
    const std::optional<DiagnosisModel> without = without_effect(model_, k);
    // Both are fitted: no start of a refit decides between them.
    const bool needless =
        without && log_evidence(model_) + log_prior_of(model_, k) - log_evidence(*without) <
                       options_.least_evidence;
    if (!without || (!needless && is_seen(model_, k))) {
      ++k;
    } else {
      take_back(k, *without, needless ? "needless once the later effects are in" : kNotSeen);
    }
  }
}

std::optional<Refit> Search::smooth_errors_instead(const CandidateScore& name,
                                                   const DiagnosisModel& without) const {
  // Chance was drawn as if errors came anew at every rest. This bound holds for any.
  const double by_chance = std::log(static_cast<double>(effects_of(model_.robot).size()) /
                                    (kShareAtRest * options_.family_wise_p));
  std::optional<Refit> errors = likeliest_smooth_errors(without, ErrorSize::specified);
  // A walk that is in the model already is another account of them, and may give way.
  DiagnosisModel plain = without;
  if (std::erase_if(plain.effects, wanders) > 0 && fit_with_noise(plain)) {
    std::optional<Refit> other = likeliest_smooth_errors(plain, ErrorSize::specified);
    if (other) other->log_evidence = EvidenceAgainst(without).of(other->model);
    if (other && (!errors || other->log_evidence > errors->log_evidence)) errors = std::move(other);
  }
  if (!errors) return errors;
  const double cost = cost_of(*name.effect, step_candidates(without).size());
  const auto evidence_in = [&](const DiagnosisModel& model) {
    return EvidenceAgainst(model).refit(name).log_evidence - cost;
  };
  // What chance does not do by itself needs no more beside them than any effect.
  const double own = evidence_in(without);
  const double enough = own > by_chance ? options_.least_evidence : by_chance;
  if (own > errors->log_evidence || evidence_in(errors->model) > enough) errors.reset();
  return errors;
}

bool Search::errs_smoothly(const DiagnosisModel& model) const {
  if (std::ranges::any_of(model.effects, wanders)) return true;
  if (!scatters(model)) return false;
  const std::optional<Refit> errors = likeliest_smooth_errors(model, ErrorSize::specified);
  return errors && errors->log_evidence > options_.least_evidence;
}

void Search::leave_to_smooth_errors() {
  const bool errs = !out_.effects.empty() && errs_smoothly(model_);
  for (std::size_t k = out_.effects.size(); errs && k-- > 0;) {
    const std::optional<DiagnosisModel> without = without_effect(model_, k);
    if (!without) continue;
    std::optional<Refit> errors = smooth_errors_instead(as_candidate(model_.effects[k]), *without);
    if (!errors) continue;
    take_back(k, *without, stands_for(*errors));
    smooth_noise_ = std::move(errors);
  }
  if (!left_) return;
  const double choice = std::log(static_cast<double>(generic_candidates(model_).size()));
  std::optional<Refit> errors = likeliest_smooth_errors(model_, ErrorSize::specified);
  if (errors &&
      errors->log_evidence > EvidenceAgainst(model_).refit(*left_).log_evidence - choice) {
    left_.reset();
    smooth_noise_ = std::move(errors);
  }
}

void Search::withdraw() {
  if (!left_) return;
  const Refit rest = EvidenceAgainst(model_).refit(*left_);
  DiagnosisModel with = rest.model;
  const GenericName what = *generic_name(*left_->effect);
  for (std::size_t k = 0; k < out_.effects.size();) {
    const std::optional<DiagnosisModel> without = without_effect(with, k);
    const CandidateScore again = as_candidate(with.effects[k]);
    // A name that explains nine tenths is a good name, with something unexplained beside it.
    const bool most = rest.log_evidence < kRemainder * out_.effects[k].log_evidence;
    if (most || !without ||
        EvidenceAgainst(*without).refit(again).log_evidence > options_.least_evidence) {
      ++k;
      continue;
    }
    out_.rejected.push_back(
        {again.effect->name(), "only stood in for what is unexplained: a dependence of " +
                                   what.channel + " on " + what.depends_on});
    out_.effects.erase(out_.effects.begin() + static_cast<std::ptrdiff_t>(k));
    model_.effects.erase(model_.effects.begin() + static_cast<std::ptrdiff_t>(k));
    with = *without;
  }
  fit_with_noise(model_);
}

void Search::find_rivals() {
  constexpr double kNegligible_nats = 12.0;
  if (out_.effects.empty()) return;
  const InitialPose present = initial_pose_of(model_);
  // What imitates an effect is as likely as what is said not to be told apart: typical sizes alone
  // are no reason to be sure. Nor are nats in motion, whose errors hang together: it is then as
  // likely as what was accepted.
  const double least_of_rival = balances_in_motion(model_) ? 0.0 : -options_.rival_nats;
  for (std::size_t k = 0; k < out_.effects.size(); ++k) {
    const std::optional<DiagnosisModel> without = without_effect(model_, k);
    if (!without) continue;
    const auto& accepted = model_.effects[k].effect;
    Candidates named = untried(*without);
    // One of each log stands for that of them all, which is no rival of it.
    std::ranges::replace_if(
        named, [&](const auto& e) { return e->name() == accepted->name(); }, accepted);
    if (as_step(*accepted)) {
      named.push_back(accepted);
      for (auto& other : steps_beside(*without, *accepted)) named.push_back(std::move(other));
    }
    const std::vector<CandidateScore> scores = scan(*without, named, {.draws = 0});
    const EvidenceAgainst against(*without);
    std::vector<Refit> refits =
        against.refits(scores, options_.refits, [](const CandidateScore&) { return true; });
    const auto evidence_of = [&](const Effect* effect) -> std::optional<double> {
      for (const Refit& r : refits) {
        if (r.score.effect.get() == effect) return r.log_evidence;
      }
      return std::nullopt;
    };
    const double own = evidence_of(accepted.get()).value_or(out_.effects[k].log_evidence);
    const std::vector<double> shares = imitation(*without, as_candidate(model_.effects[k]), named);
    std::vector<const Effect*> rivals;
    for (std::size_t j = 0; j < named.size(); ++j) {
      if (named[j] == accepted) continue;
      const std::optional<double> its = evidence_of(named[j].get());
      const std::optional<double> nats = its ? std::optional(own - *its) : std::nullopt;
      const double share = does_all(*named[j]) ? 0.0 : shares[j];
      if (told_apart(nats, share, options_.rival_nats, options_.rival_share)) continue;
      rivals.push_back(named[j].get());
      out_.effects[k].rivals.push_back(named[j]->name());
    }
    std::vector<Alternative> others;
    for (const Refit& r : refits) {
      if (r.score.effect == accepted || r.log_evidence < own - kNegligible_nats) continue;
      const bool rival = std::ranges::count(rivals, r.score.effect.get()) > 0;
      const double least = rival ? least_of_rival : -kNegligible_nats;
      others.push_back({initial_pose_of(r.model), std::max(r.log_evidence - own, least)});
    }
    // Nor is it certain that the catalogue has what is there.
    if (!out_.effects[k].described) {
      const std::optional<Refit> law =
          best_generic(against, scan(*without, generic_candidates(*without), {.draws = 0}),
                       own - kNegligible_nats);
      if (law && law->log_evidence > own - kNegligible_nats) {
        others.push_back({initial_pose_of(law->model), law->log_evidence - own});
      }
    }
    for (const Possibility& p : possibilities(present, others)) {
      rivals_.push_back(p);
    }
  }
}

}  // namespace cdprcal
