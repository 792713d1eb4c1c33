#include "cdprcal/evidence/refit.hpp"

#include <algorithm>
#include <cmath>

namespace cdprcal {
namespace {

/// Root mean square of an effect's values, in typical sizes.
double size_of(const EffectTerm& term, const Robot& robot) {
  const EffectValues typical = term.effect->typical(robot);
  double squares = 0.0;
  for (Eigen::Index j = 0; j < term.values.size(); ++j) {
    squares += std::pow(term.values[j] / typical[j % typical.size()], 2);
  }
  return std::sqrt(squares / static_cast<double>(term.values.size()));
}

}  // namespace

double log_prior_of(const EffectTerm& term) {
  for (const auto& [scale, probability] : kPriorScales) {
    if (term.prior_scale == scale) return std::log(probability);
  }
  return 0.0;
}

EvidenceAgainst::EvidenceAgainst(const DiagnosisModel& model)
    : model_(model), log_evidence_(log_evidence(model)) {}

Refit EvidenceAgainst::refit(const CandidateScore& score) const {
  Refit out = refit(model_, {score.effect, score.values});
  out.score = score;
  return out;
}

Refit EvidenceAgainst::refit(DiagnosisModel with, const EffectTerm& added) const {
  Refit out{{}, with, -1e300};
  with.effects.push_back(added);
  EffectTerm& term = with.effects.back();
  for (const PriorScale& prior : kPriorScales) {
    term.prior_scale = prior.scale;
    if (!fit_with_noise(with)) break;
    const double evidence = of(with) + log_prior_of(term);
    if (evidence > out.log_evidence) {
      out.log_evidence = evidence;
      out.model = with;
    }
    // Nothing asks for larger ones, or they are learnt.
    if (term.learnt.size() > 0 || size_of(term, with.robot) < prior.scale) break;
  }
  return out;
}

double EvidenceAgainst::of(const DiagnosisModel& other) const {
  return log_evidence(other) - log_evidence_;
}

void EvidenceAgainst::sort(std::vector<Refit>& refits) {
  std::stable_sort(refits.begin(), refits.end(),
                   [](const Refit& a, const Refit& b) { return a.log_evidence > b.log_evidence; });
}

std::optional<DiagnosisModel> without_effect(const DiagnosisModel& model, std::size_t k) {
  DiagnosisModel without = model;
  without.effects.erase(without.effects.begin() + static_cast<std::ptrdiff_t>(k));
  if (!fit_with_noise(without)) return std::nullopt;
  return without;
}

CandidateScore as_candidate(const EffectTerm& term) {
  CandidateScore out;
  out.effect = term.effect;
  out.values = term.values;
  return out;
}

bool plausible(const EffectTerm& term, const Robot& robot) {
  const EffectValues limit = term.effect->plausible(robot);
  // Nothing reads the future: what has no negative values in motion is something else then. (At
  // rest the sign of a small one-sided effect is within what its rivals leave open.)
  const bool one_sided = term.effect->info().one_sided && term.effect->needs_motion();
  for (Eigen::Index j = 0; j < term.values.size(); ++j) {
    if (std::abs(term.values[j]) > limit[j % limit.size()]) return false;
    if (one_sided && term.values[j] < 0.0) return false;
  }
  return true;
}

}  // namespace cdprcal
