// Evidence for one more effect, fitted in full: what the scan estimates from one linearisation.
#pragma once

#include <optional>

#include "cdprcal/evidence/scan.hpp"

namespace cdprcal {

/// An effect is of the order of a typical one, and sometimes far beyond: a prior of several widths
/// (EffectTerm::prior_scale), each with its probability, as of half a Cauchy distribution.
struct PriorScale {
  double scale, probability;
};
inline constexpr PriorScale kPriorScales[] = {{1.0, 0.63}, {4.0, 0.29}, {16.0, 0.08}};

/// What the prior of an effect of a fitted model has beyond the one that it was fitted under, as a
/// logarithm: the probability of its prior_scale, where that is one of those, and that its values
/// may have one cause (EffectInfo::of_one_make).
double log_prior_of(const DiagnosisModel& model, std::size_t k);

/// An effect of a model as a candidate for models without it: a refit starts at its values.
CandidateScore as_candidate(const EffectTerm& term);

/// One candidate added to a model and everything fitted again.
struct Refit {
  CandidateScore score;          ///< from the scan
  DiagnosisModel model;          ///< with the candidate as its last effect
  double log_evidence = -1e300;  ///< against the model without it; very low: the fit failed
};

/// Fits a model and compares candidates with it. `model` must be fitted.
class EvidenceAgainst {
 public:
  explicit EvidenceAgainst(const DiagnosisModel& model);
  /// Starts the candidate at the scan's linear estimate.
  [[nodiscard]] Refit refit(const CandidateScore& score) const;
  /// Starts at the model `start`, with this term. Its score is empty.
  [[nodiscard]] Refit refit(DiagnosisModel start, const EffectTerm& term) const;
  /// Evidence for another fitted model of the same readings.
  [[nodiscard]] double of(const DiagnosisModel& other) const;
  /// The refits of the best `most` of `scores` that `take` accepts, best first.
  template <class Take>
  [[nodiscard]] std::vector<Refit> refits(const std::vector<CandidateScore>& scores, int most,
                                          Take take) const {
    return refits(scores, most, take, model_);
  }
  /// The same, each started at the model `start`.
  template <class Take>
  [[nodiscard]] std::vector<Refit> refits(const std::vector<CandidateScore>& scores, int most,
                                          Take take, const DiagnosisModel& start) const {
    std::vector<Refit> out;
    for (const CandidateScore& score : scores) {
      if (static_cast<int>(out.size()) >= most) break;
      if (!take(score)) continue;
      out.push_back(refit(start, {score.effect, score.values}));
      out.back().score = score;
    }
    sort(out);
    return out;
  }

 private:
  static void sort(std::vector<Refit>& refits);
  const DiagnosisModel& model_;
  double log_evidence_;
};

/// Where the values of a model's k-th effect begin among all of them (DiagnosisModel::values).
Eigen::Index values_begin(const DiagnosisModel& model, std::size_t k);

/// The model without its effect `k`, fitted again; nothing when that fit fails.
std::optional<DiagnosisModel> without_effect(const DiagnosisModel& model, std::size_t k);

/// Whether all values are physically believable on a robot.
bool plausible(const EffectTerm& term, const DiagnosisModel& model);

}  // namespace cdprcal
