#include "cdprcal/diagnosis/evidence.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <limits>

namespace cdprcal {
namespace {

/// Peak cost with every channel's degrees of freedom as in `freedom`: comparable between models.
double profile_cost(const DiagnosisModel& model, const NoiseLevels& freedom) {
  const ChannelSums sums = channel_sums(model);
  if (!sums.valid) return std::numeric_limits<double>::infinity();
  double total = 0.0;
  const Eigen::VectorXd precision = prior_precision(model);
  Eigen::Index value = 0;
  for (const EffectTerm& term : model.effects) {
    for (const double v : term.values) total += 0.5 * precision[value++] * v * v;
  }
  for (std::size_t c = 0; c < kNoiseGroups; ++c) {
    if (freedom[c] < 1.0) continue;
    const double level =
        std::max(model.floor[c], model.noise[c] * std::sqrt(sums.squares[c] / freedom[c]));
    total +=
        freedom[c] * std::log(level) + 0.5 * sums.squares[c] * std::pow(model.noise[c] / level, 2);
  }
  return total;
}

/// ½ log|I/Λ + 1| of the last effect of a fitted model: I is the information about it with all else
/// free, Λ its prior's.
double occam_of_last(const DiagnosisModel& model) {
  Eigen::MatrixXd hessian = information(model);
  const Eigen::Index width = model.effects.back().values.size();
  const Eigen::Index begin = hessian.rows() - width;
  const Eigen::VectorXd precision = prior_precision(model).tail(width);
  hessian.diagonal().segment(begin, width) -= precision;
  Eigen::MatrixXd own = hessian.block(begin, begin, width, width);
  own -= hessian.block(begin, 0, width, begin) * hessian.topLeftCorner(begin, begin)
                                                     .completeOrthogonalDecomposition()
                                                     .solve(hessian.block(0, begin, begin, width));
  const Eigen::VectorXd sigma = precision.cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = sigma.asDiagonal() * own * sigma.asDiagonal();
  scaled.diagonal().array() += 1.0;
  const Eigen::LLT<Eigen::MatrixXd> llt(scaled);
  const Eigen::MatrixXd root = llt.matrixL();
  return root.diagonal().array().abs().max(1e-300).log().sum();
}

}  // namespace

EvidenceAgainst::EvidenceAgainst(const DiagnosisModel& model)
    : model_(model), freedom_(channel_sums(model).freedom) {
  cost_ = profile_cost(model, freedom_);
}

Refit EvidenceAgainst::refit(const CandidateScore& score) const {
  Refit out{score, model_, -1e300};
  out.model.effects.push_back({score.effect, score.values});
  if (!fit_with_noise(out.model)) return out;
  out.log_evidence = of(out.model) - occam_of_last(out.model);
  return out;
}

double EvidenceAgainst::of(const DiagnosisModel& other) const {
  return cost_ - profile_cost(other, freedom_);
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
