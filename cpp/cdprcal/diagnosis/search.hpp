// Which effects to add: forward one at a time, exchange, drop.
#pragma once

#include <functional>

#include "cdprcal/diagnosis/diagnose.hpp"
#include "cdprcal/diagnosis/small_faults.hpp"
#include "cdprcal/evidence/model_average.hpp"
#include "cdprcal/evidence/refit.hpp"

namespace cdprcal {

/// Adds to a fitted baseline what explains it best, and writes down what was accepted (without
/// values), rejected and seen on the way. `out.effects` runs parallel to the first of
/// `model.effects`; errors of the sensors (sensor_errors.hpp) follow behind.
class Search {
 public:
  /// Faults found on the way are set right in `logs`.
  Search(std::vector<Log>& logs, DiagnosisModel& model, Diagnosis& out,
         const DiagnoseOptions& options);

  /// Accepts one effect after another, or a fault of the readings' map that the log as a whole did
  /// not show, until none passes; false when progress stopped it.
  bool forward();
  /// Puts effects that were chosen into the model, one after another, whatever speaks against them;
  /// one whose fit does not settle is rejected.
  void take(const Candidates& chosen);
  /// Adds samples in motion to the model and asks for the effects that only they show. The model
  /// keeps the samples only when such an effect is accepted.
  void in_motion();
  /// Puts another effect in the place of an accepted one that it imitates, where that explains the
  /// readings better with all the others in the model: the first choices were made without the
  /// later ones. Returns whether anything was exchanged.
  bool exchange();
  /// Puts another fault of the readings' map in the place of an accepted one, where that is more
  /// probable with all effects in the model. Returns whether it did.
  bool exchange_fault();
  /// Takes out what the later effects made needless.
  void drop();
  /// Takes names back that only stood in for a dependence that no effect has: with that dependence
  /// in the model they explain nothing.
  void withdraw();
  /// Puts what is left into formulas, where some predict poses that they were not fitted on.
  void describe();
  /// Leaves to errors that change smoothly with the place or with time, as the sensors may have
  /// them, what these explain better: names that add nothing beside them, and what is left.
  void leave_to_smooth_errors();
  /// Names, for every accepted effect, what could be in its place as well as it.
  void find_rivals();
  /// Where rivals put the initial pose.
  [[nodiscard]] const std::vector<Possibility>& rivals() const { return rivals_; }
  /// The dependence that best explains what is left, when chance does not.
  [[nodiscard]] const std::optional<CandidateScore>& left() const { return left_; }
  /// The model with smooth errors at its end, where these are as probable as any name or
  /// dependence and no larger than the sensors may have them: noise that is no finding.
  [[nodiscard]] const DiagnosisModel* smooth_noise() const {
    return smooth_noise_ ? &smooth_noise_->model : nullptr;
  }

  /// Whether an umbilical, or what else does all that other names do, was accepted; and a search
  /// without such names.
  [[nodiscard]] bool found_what_does_all() const;
  void leave_out_what_does_all() { without_all_ = true; }

 private:
  bool without_all_ = false;
  bool report(const std::string& what) const;
  /// Named effects that a model does not have; where there are several logs, those of the robot
  /// also with values of each log's own.
  [[nodiscard]] Candidates names_for(const DiagnosisModel& model) const;
  /// How many of these are refitted a round: as many of either kind.
  [[nodiscard]] int refits_a_round() const {
    return (model_.runs.size() > 1 ? 2 : 1) * options_.refits;
  }
  /// The likeliest steps as they are under the noise's floor, refitted from there: one jump fills a
  /// channel's noise, which hides it from the scan and holds its refit back.
  [[nodiscard]] std::vector<Refit> jumps(const EvidenceAgainst& against,
                                         const Candidates& steps) const;
  /// Accepts the first refit that nothing speaks against, and notes what speaks against those
  /// before it; whether there is one. `rival`: a dependence that is as likely, or none; `chance`:
  /// p-value of a candidate that is no step.
  using Chance = std::function<double(const CandidateScore&)>;
  bool accept_best(std::vector<Refit>& refits, const Refit* rival, const Chance& chance);
  /// What the evidence for a name is lowered by: there are as many steps as moves and cables, and
  /// most robots stay as they are from log to log. Errors of one sensor may be any sensor's.
  [[nodiscard]] double cost_of(const Effect& effect, std::size_t steps) const;
  /// Lowers the evidence of refits by that, and sorts them anew, best first.
  void charge(std::vector<Refit>& refits, std::size_t steps = 0) const;
  /// The refit with errors of the sensors that are no finding, those that wander with time or those
  /// of one sensor alone, when it has more evidence than this.
  [[nodiscard]] std::optional<Refit> errors_of_sensors(double log_evidence) const;
  /// An accepted effect, and those that imitate most of what it does.
  [[nodiscard]] Candidates confusable(const DiagnosisModel& without, const EffectTerm& term) const;
  /// Whether any named effects, several if need be, explain as much as one dependence does.
  [[nodiscard]] bool names_reach(double log_evidence, const Refit& first) const;
  /// Empty, or why a refitted candidate is not accepted.
  [[nodiscard]] std::string objection(const Refit& candidate, const Refit* generic, double least_p,
                                      HeldOut& held) const;
  void accept(Refit& winner, const HeldOut& held);
  /// Evidence of a name against a formula: names together are as probable as formulas together, and
  /// there are fewer of them.
  [[nodiscard]] double nats_of_name(double log_evidence) const;
  /// Takes names back that a formula beats, and that add nothing to it.
  /// Rejects an accepted effect: the model is the one without it.
  void take_back(std::size_t k, const DiagnosisModel& without, const std::string& reason);
  void withdraw_stand_ins();
  /// Whether a dependence, the best of `generic`, is no chance.
  [[nodiscard]] bool is_sure(const DiagnosisModel& model, const std::optional<Refit>& dependence,
                             const Candidates& generic) const;
  /// A dependence that is no chance is what is left, if one is there without the readings' own
  /// noise, too.
  void keep_left(const std::optional<Refit>& dependence, const Candidates& generic);
  /// Sets a fault right in the model and the logs, if it predicts poses that it was not fitted on;
  /// one in the place of another need not.
  bool accept_fault(const FaultRefit& found);
  /// Whether a fault has the evidence, and chance would not do as well.
  [[nodiscard]] bool is_sure_of(const std::optional<FaultRefit>& found) const;
  /// Empty, or the law that explains the readings better than a fault does, and leaves it nothing.
  [[nodiscard]] std::string stands_for_a_law(const FaultRefit& found) const;
  /// Whether smooth errors show beside all names of a model: of what does not vary a bias is as
  /// good an account.
  [[nodiscard]] bool errs_smoothly(const DiagnosisModel& model) const;
  /// Smooth errors, as the sensors may have them, that explain more than a name would in a model
  /// without it, and leave it nothing that is sure.
  [[nodiscard]] std::optional<Refit> smooth_errors_instead(const CandidateScore& name,
                                                           const DiagnosisModel& without) const;
  /// Of a sensor that looks late in motion: whether another that is late explains more, which is
  /// then found in its place; the names of those that explain as much.
  std::vector<std::string> late_in_its_place(const DiagnosisModel& moving, Refit& found) const;
  /// Accepts the most probable fault of which that is sure.
  bool look_for_fault();

  std::vector<Log>& logs_;
  DiagnosisModel& model_;
  Diagnosis& out_;
  const DiagnoseOptions& options_;
  SmallFaults small_faults_;
  std::optional<CandidateScore> left_;
  std::optional<Refit> smooth_noise_;
  std::vector<Possibility> rivals_;
  bool stopped_ = false;  ///< by who looks on
};

/// Writes down the residuals after a step.
void record_gap(const DiagnosisModel& before, const DiagnosisModel& model,
                const std::string& after_effect, Diagnosis& out);

}  // namespace cdprcal
