// Formulas for what no name explains: a grammar of plain laws, searched by evidence.
#pragma once

#include "cdprcal/evidence/scan.hpp"

namespace cdprcal {

/// Whether any channel scatters.
bool scatters(const DiagnosisModel& model);

/// A law and its prior probability. Every pair of a channel and a variable is as probable as any
/// other, and so is every kind of law in it; kinds with more constants to choose from share theirs.
struct Formula {
  std::shared_ptr<const Effect> effect;
  double log_prior = 0.0;
};

/// Laws of one channel in one or two variables that an engineer would try: straight and bent lines,
/// steps, kinks, sines, settling and creeping with time, products; alike in all cables or cable by
/// cable. Each is an effect of text (effects/text_effect.hpp), straight in its parameters. Of the
/// channels that scatter, where any does: one at its ripple has nothing to describe.
std::vector<Formula> formula_candidates(const DiagnosisModel& model);

/// What speaks for a formula by one linearisation; its prior is not in its evidence.
struct LikelyFormula {
  CandidateScore score;
  double log_prior = 0.0;
};

/// The most probable of them, at most one of a kind, best first, the periods of sines made precise.
std::vector<LikelyFormula> likely_formulas(const DiagnosisModel& model, std::size_t count);

/// The formula with what it may be on a machine said of its values: "a drum of 50 mm radius …".
/// The same effect where there is nothing to say.
std::shared_ptr<const Effect> with_meaning(const std::shared_ptr<const Effect>& formula,
                                           const Eigen::VectorXd& values);

}  // namespace cdprcal
