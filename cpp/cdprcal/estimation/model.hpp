// A robot's runs with everything in them estimated together: poses, offsets, values of effects
// under their priors, and noise.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "cdprcal/effects/catalogue.hpp"
#include "cdprcal/readings/noise.hpp"

namespace cdprcal {

/// Groups of readings that share one noise level. Single readings while the platform moves are
/// groups of their own: their noise is not averaged over a rest, and motion adds to it.
enum class NoiseGroup : int {};
inline constexpr int kRestGroups = kChannels;
inline constexpr int kNoiseGroups = 2 * kRestGroups;
constexpr NoiseGroup at_rest(Channel channel) { return static_cast<NoiseGroup>(channel); }
/// The balance's is always empty.
constexpr NoiseGroup in_motion(Channel channel) {
  return static_cast<NoiseGroup>(static_cast<int>(channel) + kRestGroups);
}
/// Whether a measurement's readings are of those groups.
inline bool is_moving(const Measurement& m) {
  return m.kind == PoseKind::kinematic_pose && m.samples == 1;
}
/// "length", "length while moving" …
std::string to_string(NoiseGroup group);
/// Levels of noise count in SI units; the balance's, which is relative to its covariance, in the
/// load cells' σ [N].
double noise_unit(const Robot& robot, NoiseGroup group);

/// One run: where the platform stood, and what was read there.
struct DiagnosisRun {
  std::string name;
  std::vector<Measurement> measurements;  ///< measurements[0] is the initial pose
  std::vector<SampleRange> rows;          ///< of the log, behind each measurement
  std::vector<Pose> poses;                ///< estimates
  Eigen::VectorXd offsets;                ///< of lengths (n), swivels (n), yaw: reading − model
  ActiveEffects known;                    ///< that the robot file lists: held at their values
};

/// Moments in motion share what is wrong with their neighbours: of the last `moments` measurements
/// of a run as many share an error as `moments_a_reading` says, so only every so many is kept as a
/// witness of its own. Enough are kept to see an effect by, which is shared as well. How many are
/// still worth one reading: 1, or more where as few as that are kept.
double thin_out(DiagnosisRun& run, std::size_t moments, double moments_a_reading);

/// Reading − model of lengths, swivels and yaw at a pose (2n + 1); 0 where nothing was read.
Eigen::VectorXd offsets_at(const Robot& robot, const Pose& pose, const Measurement& m);

/// An effect in the model. Values of run-scoped effects are kept for each run in turn.
struct EffectTerm {
  std::shared_ptr<const Effect> effect;
  Eigen::VectorXd values;    ///< size(n), or size(n) · runs
  double prior_scale = 1.0;  ///< prior's σ in typical sizes
  Eigen::VectorXd learnt{};  ///< of Effect::learnt_widths: each group's width besides; empty: 1
  /// Where those of run `run` begin.
  [[nodiscard]] int begin_of(std::size_t run, int cables) const {
    const bool by_run = effect->info().scope == EffectScope::run;
    return by_run ? static_cast<int>(run) * effect->size(cables) : 0;
  }
};

/// Noise of one reading, a channel; the balance's is relative to its own covariance.
using NoiseLevels = std::array<double, kNoiseGroups>;

struct DiagnosisModel {
  Robot robot;                      ///< as in the robot file
  std::vector<EffectTerm> effects;  ///< in the order accepted
  std::vector<DiagnosisRun> runs;
  NoiseLevels noise{};        ///< present estimate: m, rad, rad, rad, 1
  NoiseLevels floor{};        ///< below which no estimate goes: the readings' own ripple
  double rest_samples = 1.0;  ///< readings behind the mean that noise and floor are for
  Signals signals{};          ///< how those readings come

  [[nodiscard]] int pose_count() const;
  /// The values of the effects, one after another.
  [[nodiscard]] Eigen::VectorXd values() const;
  /// The effects as they act on run `run`, at their values or at others (as values() has them); the
  /// known ones follow after `effects`.
  [[nodiscard]] ActiveEffects active(std::size_t run) const { return active(run, values()); }
  [[nodiscard]] ActiveEffects active(std::size_t run, const Eigen::VectorXd& values) const;
};

/// Whether the rests of a channel disagree with the model by more than their readings ripple. An
/// effect may fill a channel, and pass for noise in it.
bool scatters(const DiagnosisModel& model, NoiseGroup group);

/// Whether moments of motion balance in a model. What is not known of their accelerations follows
/// the motion, and so its readings: a law of the residuals by readings proves nothing there, but
/// for one with a name and a mechanism of its own.
bool balances_in_motion(const DiagnosisModel& model);

/// Columns of the common unknowns: offsets of all runs, accepted effects, candidates.
struct CommonLayout {
  int offsets = 0, accepted = 0, candidates = 0;
  std::vector<int> accepted_begin, accepted_size;    ///< one an accepted effect
  std::vector<int> candidate_begin, candidate_size;  ///< one a candidate
  [[nodiscard]] int nuisance() const { return offsets + accepted; }
  [[nodiscard]] int size() const { return offsets + accepted + candidates; }
};

/// What a row of a system is.
struct SystemRow {
  NoiseGroup channel = at_rest(Channel::length);
  int component = 0;   ///< cable, angle, axis or wrench row
  double scale = 1.0;  ///< unwhitened = whitened · scale (balance rows: in units of its covariance)
};

/// The model's residuals and derivatives, whitened, pose after pose; and the part of them that a
/// pose's own six unknowns cannot explain (the projection M off the pose).
struct DiagnosisSystem {
  /// The rows of one pose.
  struct PoseRange {
    std::size_t run = 0, pose = 0;
    Eigen::Index begin = 0, size = 0;
  };
  CommonLayout layout;
  std::vector<PoseRange> poses;
  std::vector<SystemRow> rows;
  Eigen::VectorXd residual;                          ///< (model − reading) / σ
  Eigen::Matrix<double, Eigen::Dynamic, 6> by_pose;  ///< of each row's own pose
  Eigen::MatrixXd by_common;
  Eigen::VectorXd free_residual;    ///< M · residual
  Eigen::MatrixXd free_by_common;   ///< M · by_common
  Eigen::VectorXd freedom;          ///< diagonal of M
  Eigen::VectorXd prior_precision;  ///< 1/σ² of the accepted effects' values, 0 for offsets
  Eigen::VectorXd prior_residual;   ///< values/σ of the accepted effects (offsets: 0)
  bool valid = true;

  /// How a pose answers its own rows: 6 × rows, the pseudoinverse of its part of by_pose.
  [[nodiscard]] Eigen::MatrixXd pose_by_rows(const PoseRange& pose) const;
};

using Candidates = std::vector<std::shared_ptr<const Effect>>;

/// Linearises the model at its present state; candidates enter at zero, their columns scaled by
/// their prior σ (so one unit is one typical size).
DiagnosisSystem linearise(const DiagnosisModel& model, const Candidates& candidates = {});

/// 1/σ² of the prior of each value of the effects, in the order of their columns.
Eigen::VectorXd prior_precision(const DiagnosisModel& model);

/// Covariance of the offsets and the accepted effects' values, all poses free, their prior
/// included. NaN where the model cannot be evaluated.
Eigen::MatrixXd covariance(const DiagnosisModel& model);

/// ½ Σ (residual/σ)² + prior; NaN where the model cannot be evaluated.
double penalised_cost(const DiagnosisModel& model);

/// Steps of a fit before it is called lost.
inline constexpr int kMostFitSteps = 100;

/// log of the probability of the readings at the model's noise, up to what all models of them
/// share: poses and offsets integrated out under flat priors, values under theirs (Laplace's
/// approximation about a fitted state). With the noise that estimate_noise settles at, its
/// restricted maximum. -infinity where the model cannot be evaluated.
double log_evidence(const DiagnosisModel& model);

/// To the maximum a posteriori at the present noise levels. Returns whether it settled.
bool fit(DiagnosisModel& model, int max_steps = kMostFitSteps);

/// The noise to begin with: the robot file's σ, not below the readings' own ripple in the mean over
/// an average rest. Fills in rest_samples and signals too.
void start_noise(DiagnosisModel& model, const Signals& signals);

/// Noise levels from the residuals: each channel's sum of squares over what the leverages leave of
/// its rows, floored. Changes model.noise; returns the largest relative change.
double estimate_noise(DiagnosisModel& model);

/// fit and estimate_noise in turn until both settle. Returns whether the last fit did; the noise is
/// that of its residuals in any case.
bool fit_with_noise(DiagnosisModel& model);

/// Degrees of freedom that the leverages leave each channel, and its whitened sum of squares where
/// every pose goes where its own readings want it.
struct ChannelSums {
  bool valid = false;  ///< false: the model cannot be evaluated
  NoiseLevels freedom{}, squares{};
};
ChannelSums channel_sums(const DiagnosisModel& model);

/// Covariance of the initial pose of run `run` under the model's noise, effects estimated too. NaN
/// where the model cannot be evaluated, or has no such run.
Matrix6 initial_pose_covariance(const DiagnosisModel& model, std::size_t run);

}  // namespace cdprcal
