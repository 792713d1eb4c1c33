// The initial pose from a run of which every stretch counts: the platform balances also while it
// moves.
#pragma once

#include "cdprcal/calibration/calibrate.hpp"
#include "cdprcal/motion/damping.hpp"
#include "cdprcal/motion/pushes.hpp"
#include "cdprcal/motion/swings.hpp"

namespace cdprcal {

struct InMotionOptions {
  /// Of the method unified and the full formulation, with noise from the data; at_s and guess
  /// unset.
  CalibrateOptions calibrate;
  int most_moments = 1000;  ///< of motion that count, beside the rests
  /// How far apart moments are, in lengths of the stretch that each is the mean of
  /// (stretches.hpp); from 1 on they share no samples. Neighbours that share three quarters of them
  /// leave none out.
  double spacing = 0.25;
  int rounds = 2;  ///< how often the motion is found anew
  /// Accelerations are those that effects may multiply (known_accelerations.hpp).
  bool multiplied = false;
  /// Rests and motion also where load cells contradict what geometry agrees on: not converged, for
  /// a search of what is wrong.
  bool contradicted = false;
};

/// Moments that share no samples, without allowances for effects: for a search that takes each
/// moment for independent, and looks for those effects, also where nothing balances without them.
InMotionOptions for_a_search();

/// What is found beside the poses, and the path that accelerations come from depends on.
struct Beside {
  EffectValues damping_1_s = EffectValues::Zero(2);  ///< of shifts, of turns (damping.hpp)
  /// What makes readings of one moment belong to different ones (EffectInfo::of_lateness), where it
  /// is clear.
  ActiveEffects late;
};

struct InMotion {
  /// Rests (static_poses) and moments of motion (kinematic_poses), all in balance. Where it does
  /// not converge: what calibrate() says of the same log, and why in its reason.
  Calibration calibration;
  bool in_motion = false;  ///< whether it is that of rests and motion
  std::string without;     ///< why it is not, where load cells could have told of motion
  Beside beside;
  /// What the last round moved the initial pose by: position [m], world-frame rotation vector
  /// [rad]. Zero where path and poses have settled; its uncertainty allows for it otherwise.
  Vector6 moved = Vector6::Zero();
  std::vector<Swing> swings;       ///< with locked winches
  std::vector<Push> pushes;        ///< in which no balance counts: its force is not known
  double moments_a_reading = 1.0;  ///< so many are worth one independent reading
};

/// As calibrate(), with the balance in motion: (Ξᵀτ − f) + M ν̇ + h(ν) + damping = 0
/// (inertial_wrench.hpp, damping.hpp) at moments between the rests, or all along where there are
/// none. What is read there is the mean over a stretch of the path, which is the run smoothed with
/// the last round's calibration. Throws InputError as calibrate() does, and
/// for options that leave motion out.
InMotion calibrate_in_motion(const Robot& robot, const Log& log,
                             const InMotionOptions& options = {});

}  // namespace cdprcal
