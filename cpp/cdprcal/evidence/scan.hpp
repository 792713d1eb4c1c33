// The whole catalogue at once: which effect would explain what is left?
#pragma once

#include <functional>

#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

/// One candidate's score, from one linearisation and no refit.
struct CandidateScore {
  std::shared_ptr<const Effect> effect;
  double log_evidence = 0.0;  ///< of the effect under its prior against its absence
  double p_value = 1.0;       ///< family-wise: how often the best of all would do as well by chance
  Eigen::VectorXd values;     ///< linear estimate, internal units
  Eigen::VectorXd deviation;  ///< its standard deviation
  bool visible = false;       ///< a typical size would show at all (information above the prior's)
  /// Size, in typical sizes, from which on four of five such effects would be found here; NaN where
  /// the readings say nothing of it, or nobody asked (ScanOptions::limits).
  double detectable = kNaN;
};

/// What is asked of an effect before it is accepted, unless told otherwise: the chance that a clean
/// log is accused of anything, and nats.
inline constexpr double kFamilyWiseChance = 0.01, kLeastEvidence = 3.0;
/// Of that chance, what effects may use that rests show.
inline constexpr double kShareAtRest = 0.6;

/// Effects of the catalogue that a model does not have and its poses can show.
Candidates untried(const DiagnosisModel& model);
/// Those that a model does not have and that take just this to show.
Candidates untried(const DiagnosisModel& model, Shows shows);

struct ScanOptions {
  int draws = 999;  ///< of chance residuals behind the p-values; 0: no p-values
  std::uint64_t seed = 1;
  bool limits = false;  ///< also what size would show
};

/// Scores of all candidates, best first. With S = CᵀMr and I = CᵀMC (columns C in prior units, M
/// the projection off poses, offsets and accepted effects) the MAP value is (I + 1)⁻¹S; evidence is
/// Σ ν/2 · log(s0²/s1²) over channels, whose noise is unknown above its floor, minus the prior's
/// penalty and Occam's ½ log|I + 1|.
std::vector<CandidateScore> scan(const DiagnosisModel& model, const Candidates& candidates,
                                 const ScanOptions& options = {});

/// The same of any number of candidates, so many at a time, each part best first and `take` called
/// with each score: all their columns at once would take memory in the square of the poses.
void scan_in_parts(const DiagnosisModel& model, const Candidates& candidates, std::size_t at_a_time,
                   const std::function<void(CandidateScore&&)>& take);

/// Chance that noise alone gives any of so many candidates this evidence, at most: there a Bayes
/// factor is 1 on average, so that it exceeds e^E with probability e^-E at most (Markov), and one
/// of K does with K e^-E.
double chance_at_most(double log_evidence, std::size_t candidates = 1);

/// Whether a score is so high among so many candidates that none of so many draws would reach it:
/// then nothing need be drawn.
bool beyond_chance(const CandidateScore& score, std::size_t candidates, int draws);

/// Share of `winner`'s signature that each candidate could imitate (0 … 1), in the order given.
std::vector<double> imitation(const DiagnosisModel& model, const CandidateScore& winner,
                              const Candidates& candidates);

}  // namespace cdprcal
