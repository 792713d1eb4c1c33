// From a log to the initial pose, with nothing picked by hand.
#pragma once

#include "cdprcal/calibration/refine.hpp"
#include "cdprcal/effects/corrected_run.hpp"
#include "cdprcal/readings/log.hpp"

namespace cdprcal {

/// unified: statics at equilibria, kinematics everywhere. statics ("static", paper τlσε):
/// equilibria only. kinematic (paper lσε): samples along the run, no statics.
enum class Method { unified, statics, kinematic };
/// full: six-equation wrench statics and all that pose 0 knows. paper: eqs 13–17 to the letter.
enum class Formulation { full, paper };

/// from_data: estimated from the readings, never below their ripple (refine.hpp), outliers and
/// slack cables left out. specified: the robot file's σ and every reading, as the paper.
enum class NoiseSource { from_data, specified };

struct CalibrateOptions {
  Method method = Method::unified;
  Formulation formulation = Formulation::full;
  /// Empty: from_data for the full formulation, specified for the paper's.
  std::optional<NoiseSource> noise;
  /// With noise from data: count what effects that nobody named may do to the initial pose
  /// (allow_for_effects.hpp).
  bool allow_for_effects = true;
  std::vector<double> at_s;  ///< poses by hand; the first is the reference. Empty: automatic
  int segment = -1;          ///< which segment is the run, from 0; −1: the last
  double kinematic_spacing_s = 1.0;  ///< between samples that count as poses of their own
  std::vector<Pose> guess;           ///< one a pose, or only ζ0; empty: automatic
  /// Guesses of ζ0 to try while no minimum agrees with the readings; without load cells the rests
  /// alone and guesses all over the workspace follow (1: neither).
  int most_starts = 8;
  DetectionOptions detection;
  SolveOptions solve;
  /// What happened in this log alone (steps), held at its values beside the robot file's effects.
  ActiveEffects happened;
};

struct Calibration {
  CalibrationResult result;
  CalibrationProblem problem;           ///< what was solved: it can be solved again
  std::vector<Equilibrium> equilibria;  ///< found in the run (empty with at_s)
  std::vector<GatedReading> gated;      ///< readings left out of the problem
  Signals signals{};                    ///< how the samples of each channel come
  double reference_time_s = 0.0;
  int static_poses = 0;  ///< the reference included, when it is one
  int kinematic_poses = 0;
  /// Moments in motion contradicted the rests, which agree among themselves, and do not count: a
  /// sensor may come late, or be held.
  bool motion_left_out = false;
};

/// The effects that the robot file lists for this log, and what happened in it.
ActiveEffects known_effects(const Robot& robot, const Log& log, const CalibrateOptions& options);

/// options.noise, or its default for the formulation.
NoiseSource noise_source(const CalibrateOptions& options);

/// The run that a calibration reads: with noise from data, without outliers.
CorrectedRun corrected_run(const Robot& robot, const Log& log, const CalibrateOptions& options);

/// With noise from data: refine in place of problem, result and what was gated.
void refine_in_place(const CalibrateOptions& options, Calibration& calibration);

/// The problem that a log poses under these options, and the equilibria it was drawn from. What the
/// robot file lists as known effects is part of the problem; faults of the readings are set right.
/// Throws InputError for a log that does not fit the robot or the options.
Calibration prepare(const Robot& robot, const Log& log, const CalibrateOptions& options = {});

/// prepare, guess, solve, refine, and allow_for_effects where the options ask for it. Starts again
/// from other guesses while no minimum agrees with the readings, and keeps the best. Throws as
/// prepare does; otherwise see result.status.
Calibration calibrate(const Robot& robot, const Log& log, const CalibrateOptions& options = {});

/// "unified", "static", "kinematic"; "full", "paper". Throw InputError naming the choices.
Method parse_method(const std::string& name);
Formulation parse_formulation(const std::string& name);
/// "data", "specified".
NoiseSource parse_noise_source(const std::string& name);
const char* to_string(Method method);
const char* to_string(Formulation formulation);
const char* to_string(NoiseSource source);

}  // namespace cdprcal
