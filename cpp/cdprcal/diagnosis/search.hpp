// Which effects to add: forward one at a time, exchange, drop.
#pragma once

#include "cdprcal/diagnosis/diagnose.hpp"
#include "cdprcal/diagnosis/evidence.hpp"

namespace cdprcal {

/// Adds to a fitted baseline what explains it best, and writes down what was accepted (without
/// values), rejected and seen on the way. `out.effects` runs parallel to `model.effects`.
class Search {
 public:
  Search(const std::vector<Log>& logs, DiagnosisModel& model, Diagnosis& out,
         const DiagnoseOptions& options);

  /// Accepts one effect after another until none passes; false when progress stopped it.
  bool forward();
  /// Adds samples in motion to the model and asks for the effects that only they show. The model
  /// keeps the samples only when such an effect is accepted.
  void in_motion();
  /// Puts another effect in the place of an accepted one that it imitates, where that explains the
  /// readings better with all the others in the model: the first choices were made without the
  /// later ones. Returns whether anything was exchanged.
  bool exchange();
  /// Takes out what the later effects made needless.
  void drop();
  /// Takes names back that only stood in for a dependence that no effect has: with that dependence
  /// in the model they explain nothing.
  void withdraw();
  /// Names, for every accepted effect, what could be in its place as well as it.
  void find_rivals();
  /// The dependence that best explains what is left, when chance does not.
  [[nodiscard]] const std::optional<CandidateScore>& left() const { return left_; }

 private:
  bool report(const std::string& what) const;
  /// Effects of the catalogue that the model does not have.
  [[nodiscard]] static Candidates untried(const DiagnosisModel& model, bool in_motion = false);
  /// An accepted effect, and those that imitate most of what it does.
  [[nodiscard]] Candidates confusable(const DiagnosisModel& without, const EffectTerm& term) const;
  /// Whether any named effects, several if need be, explain as much as one dependence does.
  [[nodiscard]] bool names_reach(double log_evidence, const Refit& first) const;
  /// Empty, or why a refitted candidate is not accepted.
  [[nodiscard]] std::string objection(const Refit& candidate, const Refit* generic, double least_p,
                                      HeldOut& held) const;
  void accept(Refit& winner, const HeldOut& held);

  const std::vector<Log>& logs_;
  DiagnosisModel& model_;
  Diagnosis& out_;
  const DiagnoseOptions& options_;
  std::optional<CandidateScore> left_;
};

/// Writes down the residuals after a step.
void record_gap(const DiagnosisModel& before, const DiagnosisModel& model,
                const std::string& after_effect, Diagnosis& out);

}  // namespace cdprcal
