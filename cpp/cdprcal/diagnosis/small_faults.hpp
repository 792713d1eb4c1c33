// Faults of the readings' map that change them no more than an effect does.
#pragma once

#include "cdprcal/diagnosis/discrete.hpp"
#include "cdprcal/evidence/refit.hpp"

namespace cdprcal {

/// A model in which a fault is set right, fitted again.
struct FaultRefit {
  DiscreteFault fault;   ///< with its evidence
  DiagnosisModel model;  ///< with the effects of the model that it is compared with, no more
  /// What its evidence is of: each with the effect that explains most beside it.
  DiagnosisModel judged_without, judged_with;
  double log_posterior = 0.0;  ///< evidence and what was known before, against the model as it is
};

/// What hangs on a platform does all that a weight, a force or a wrong angle does to its balance:
/// that it does so says nothing, only its evidence does.
bool does_all(const Effect& effect);
/// Effects that a model does not have and that may hide a fault, or be what looks like one.
Candidates beside_faults(const DiagnosisModel& model);

/// What faults of every kind are judged against: a model that must outlive it, and the same with
/// the effect of `beside` that explains most of what it leaves, found when it is first asked for.
class Unfaulted {
 public:
  /// A model, and the evidence for the effect that was added; 0 where none explains more.
  struct WithBest {
    DiagnosisModel model;
    double log_evidence = 0.0;
  };
  explicit Unfaulted(const DiagnosisModel& model) : model_(model), beside_(beside_faults(model)) {}
  [[nodiscard]] const DiagnosisModel& model() const { return model_; }
  /// Of any model, with the same candidates.
  [[nodiscard]] WithBest with_best(const DiagnosisModel& model) const;
  [[nodiscard]] const WithBest& with_best();
  /// Evidence for another model of the same readings, of which that for it `alone` is known: each
  /// with what explains most beside it.
  [[nodiscard]] double evidence_for(double alone, const WithBest& other) {
    return alone + other.log_evidence - with_best().log_evidence;
  }

 private:
  const DiagnosisModel& model_;
  Candidates beside_;
  std::optional<WithBest> with_best_;
};

/// The faults of the attitude's map, of which a model has one or none. An AHRS that speaks another
/// order than it is read in is off by the product of two tilts, which no cost of a whole log shows:
/// it takes a refit, and the same evidence that effects are held to.
class SmallFaults {
 public:
  /// By the first run of a model, in which no such fault is set right yet.
  explicit SmallFaults(const DiagnosisModel& model);

  /// The most probable of the faults that the model does not have. With and without it, the effect
  /// that then explains most is in the model, too: a drift hides an order, and an order stands in
  /// for a drift. Faults within `rival_nats` are named in its text. Nothing where none can be
  /// fitted, or most poses are samples in motion without a balance.
  [[nodiscard]] std::optional<FaultRefit> best(Unfaulted& without, double rival_nats) const;
  /// Sets a fault right in place of the one that was taken before.
  void take(const DiscreteFault& fault, std::vector<Log>& logs);
  [[nodiscard]] const std::optional<DiscreteFault>& taken() const { return taken_; }

 private:
  void exchange(const DiscreteFault& fault, Robot& robot, Log& log) const;
  [[nodiscard]] DiagnosisModel exchanged(const DiscreteFault& fault,
                                         const DiagnosisModel& model) const;

  Robot given_;
  std::vector<DiscreteFault> faults_;
  std::optional<DiscreteFault> taken_;
};

}  // namespace cdprcal
