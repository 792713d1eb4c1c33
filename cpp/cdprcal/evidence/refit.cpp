#include "cdprcal/evidence/refit.hpp"

#include <algorithm>
#include <cmath>

#include "cdprcal/decompositions.hpp"

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

/// What readings say of the values of an effect of a fitted model, N(values, V), over the prior
/// N(0, S) that they were fitted under: that is all it takes to put another prior in its place.
class ToldOfValues {
 public:
  ToldOfValues(const DiagnosisModel& model, std::size_t k) : values_(model.effects[k].values) {
    const Eigen::Index size = values_.size();
    const Eigen::Index begin = values_begin(model, k);
    const Eigen::MatrixXd common = covariance(model);
    const Eigen::Index first = common.rows() - model.values().size() + begin;
    posterior_ = Cholesky<Eigen::MatrixXd>(common.block(first, first, size, size));
    precision_ = prior_precision(model).segment(begin, size);
  }

  /// Evidence for values that have one cause and differ by a share of what they have in common,
  /// against values of their own.
  [[nodiscard]] double evidence_for_one_cause(double share) const {
    const Eigen::Index size = values_.size();
    const Eigen::VectorXd sigma = precision_.cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(size, size);
    const Eigen::MatrixXd alike = Eigen::MatrixXd::Ones(size, size) + share * share * one;
    const Cholesky<Eigen::MatrixXd> prior(sigma.asDiagonal() * alike * sigma.asDiagonal());
    Eigen::MatrixXd information = posterior_.solve(one) + prior.solve(one);
    information.diagonal() -= precision_;
    const Cholesky<Eigen::MatrixXd> with(information);
    if (!posterior_.ok() || !with.ok()) return 0.0;
    const Eigen::VectorXd told = posterior_.solve(values_);
    return 0.5 * (told.dot(with.solve(told) - values_) - precision_.array().log().sum() -
                  prior.log_determinant() - posterior_.log_determinant() - with.log_determinant());
  }

 private:
  const Eigen::VectorXd& values_;
  Cholesky<Eigen::MatrixXd> posterior_;  ///< of V
  Eigen::VectorXd precision_;            ///< of the prior, each value's
};

}  // namespace

double log_prior_of(const DiagnosisModel& model, std::size_t k) {
  // A wrong number for all drums differs by nothing, drums of one make by what they are made to.
  constexpr double kOneCause = 0.5, kOneNumber = 0.01, kOneMake = 0.1;
  const EffectTerm& term = model.effects[k];
  double out = 0.0;
  for (const auto& [scale, probability] : kPriorScales) {
    if (term.prior_scale == scale) out = std::log(probability);
  }
  const bool of_all = term.values.size() == term.effect->size(model.robot.cable_count());
  if (term.effect->info().of_one_make && of_all && term.values.size() > 1) {
    const ToldOfValues told(model, k);
    out += std::log(1.0 - kOneCause +
                    0.5 * kOneCause *
                        (std::exp(told.evidence_for_one_cause(kOneNumber)) +
                         std::exp(told.evidence_for_one_cause(kOneMake))));
  }
  return out;
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
    const double evidence = of(with) + log_prior_of(with, with.effects.size() - 1);
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

Eigen::Index values_begin(const DiagnosisModel& model, std::size_t k) {
  Eigen::Index begin = 0;
  for (std::size_t i = 0; i < k; ++i) begin += model.effects[i].values.size();
  return begin;
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

bool plausible(const EffectTerm& term, const DiagnosisModel& model) {
  const EffectValues limit = term.effect->plausible(model.robot);
  // Nothing reads the future, and no friction drives: what has no negative values in motion is
  // something else then. (At rest the sign of a small one-sided effect is within what its rivals
  // leave open.)
  const bool one_sided =
      term.effect->info().one_sided && (term.effect->needs_motion() || balances_in_motion(model));
  for (Eigen::Index j = 0; j < term.values.size(); ++j) {
    if (std::abs(term.values[j]) > limit[j % limit.size()]) return false;
    if (one_sided && term.values[j] < 0.0) return false;
  }
  return true;
}

}  // namespace cdprcal
