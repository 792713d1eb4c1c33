// Names what the model lacks: gates, discrete faults, scan, refit, held-out test, rivals, repeat.
#pragma once

#include <functional>
#include <optional>

#include "cdprcal/diagnosis/discrete.hpp"
#include "cdprcal/diagnosis/generic.hpp"
#include "cdprcal/diagnosis/held_out.hpp"
#include "cdprcal/diagnosis/separation.hpp"
#include "cdprcal/evidence/scan.hpp"

namespace cdprcal {

struct DiagnoseOptions {
  double family_wise_p = kFamilyWiseChance;  ///< chance that a clean log is accused of anything
  double least_evidence = kLeastEvidence;    ///< nats
  double rival_nats = kRivalNats;            ///< within this of the winner: cannot be told apart
  double rival_share = kRivalShare;          ///< or imitating this share of its signature
  int most_effects = 12;                     ///< bounds the time
  int refits = 5;                            ///< candidates refitted a round
  bool motion = false;                       ///< moments of motion count as rests do
  ScanOptions scan;
  /// Names of effects to fit in this order, with no search: what a person chose. Empty: none.
  std::optional<std::vector<std::string>> effects;
  /// Known of these logs from an earlier diagnosis: set right with no search. Empty: looked for.
  std::optional<std::vector<DiscreteFault>> faults;
  GoOn progress;  ///< false stops; what was found is kept
};

/// described: a formula explains it, no name. undetermined: too little was measured to say, or
/// `progress` stopped the search.
enum class Verdict { consistent, explained, unexplained, undetermined, described };
const char* to_string(Verdict verdict);

struct NamedEffect {
  std::shared_ptr<const Effect> effect;
  EffectValues values;  ///< as files and people see them (reported units)
  EffectValues standard_deviation;
  bool described = false;  ///< a formula that the search wrote, not a name
  double log_evidence = 0.0;
  double p_value = 1.0;
  std::vector<std::string> rivals;
  /// Of a step: time_s since the run's first sample; cable (from 1), of one cable's.
  std::vector<std::pair<std::string, double>> where;
  double held_out_before = kNaN, held_out_after = kNaN;  ///< ½ Σ (residual/σ)² a held-out pose
};

struct RejectedEffect {
  std::string name, reason;
};

struct Unexplained {
  std::string channel;
  double rms = 0.0, sigma = 0.0;  ///< of what is left, and of the ripple; in the channel's unit
  std::string depends_on;
  int cable = -1;  ///< that alone depends so; -1: several, or the channel is of no cable
};

/// Errors of a channel that wander with time: counted as noise, not as a finding.
struct Wandering {
  std::string channel;
  double rms = 0.0, sigma = 0.0;  ///< over the rests, and the robot file's; in the channel's unit
};

/// Errors of one sensor, anew at every rest, beyond those of its like: counted as noise, not as a
/// finding.
struct OwnErrors {
  std::string column;                         ///< as a log calls it: length_3_m
  double rms = 0.0, like = 0.0, sigma = 0.0;  ///< over the rests, the noise of its like, and the
                                              ///< robot file's; in the column's unit
  double at_s = kNaN;  ///< of the run: the one rest at which it is off; NaN: at several
};

/// Errors that are a smooth function of the place, of the channels in which they stand out of the
/// noise. Unexplained: what the model lacks and nobody could name or describe, which takes part in
/// every σ. Else within the sensors' specification, and counted as noise.
struct Discrepancy {
  double reach_m = kNaN;  ///< as far apart as two places are whose errors differ
  std::vector<Wandering> channels;
};

struct Gap {
  std::string after_effect;  ///< "" before any
  std::string channel;       ///< with its unit: length_m … tension_N, position_m
  double train_rms = kNaN, held_out_rms = kNaN;
};

/// What this log could see of an effect, found or not.
struct Identifiability {
  std::string name;
  bool visible = false;
  double detectable = kNaN;        ///< smallest size, in typical sizes, before any effect
  double detectable_after = kNaN;  ///< with the accepted effects in the model; NaN for these
};

struct Diagnosis {
  Verdict verdict = Verdict::unexplained;
  std::string reason;
  std::vector<DiscreteFault> faults;
  std::vector<NamedEffect> effects;  ///< in the order accepted
  std::vector<RejectedEffect> rejected;
  std::vector<Unexplained> unexplained;
  /// By what the readings misfit although nothing was found, where that may well be an effect;
  /// else empty.
  std::string misfit;
  std::vector<Wandering> wandering;   ///< empty: errors come anew at every rest
  std::vector<OwnErrors> own_errors;  ///< empty: all sensors of a channel are alike
  Discrepancy discrepancy;            ///< empty: nothing that changes with the place
  std::vector<Gap> gap;
  std::vector<Identifiability> identifiability;
  std::vector<CandidateScore> ranking;  ///< of all effects on the baseline, best first; no refit
  std::vector<std::string> next;
  std::vector<std::string> gated;                ///< readings left out, with their time
  Pose initial_pose_before, initial_pose_after;  ///< of the first run; calibrate's where one log is
                                                 ///< consistent: nothing was found to change it
  Matrix6 covariance_before = Matrix6::Constant(kNaN), covariance_after = Matrix6::Constant(kNaN);
  DiagnosisModel baseline, model;  ///< fitted before any effect, and after the last
  Robot corrected;                 ///< the robot with discrete faults and effects
};

/// One robot, one or more logs. Throws InputError for a log that does not fit the robot.
Diagnosis diagnose(const Robot& robot, const std::vector<Log>& logs,
                   const DiagnoseOptions& options = {});

}  // namespace cdprcal
