// Where the solver starts from (paper §3.3), without anyone's help.
#pragma once

#include <optional>

#include <vector>

#include "cdprcal/estimation/problem.hpp"

namespace cdprcal {

/// Guesses for ζ0, best first: from absolute sensors (position, direct lengths), where there are
/// any; the direct problem at the set-point τ0 (§3.3), if there is one, and at the measured
/// tensions, then, for references without tensions or far from rest, positions spread below the
/// pulleys at the measured roll and pitch. Never empty. `effects` are known effects, at their
/// values.
std::vector<Pose> reference_guesses(const Robot& robot, const Measurement& reference,
                                    const ActiveEffects& effects = {});

/// More of them, evenly spread (Halton) from the pulleys down to twice their width, and turned by
/// up to 40° where nothing reads the yaw: for readings that no minimum agrees with from the best
/// ones.
std::vector<Pose> spread_guesses(const Robot& robot, const Measurement& reference, int count);

/// Absolute readings of one pose: what is NaN does not count.
struct AbsoluteReadings {
  CableVector length_m;
  CableVector swivel_rad;
  Vector3 roll_pitch_yaw_rad = Vector3::Constant(kNaN);
  AbsoluteFields<ReadingOf> absolute{};  ///< angles count above, as the yaw
};

/// The pose that explains absolute readings best (weighted Gauss–Newton with damping, from
/// `start`): step 3 of §3.3. Returns the best pose met, which is a guess and no more.
Pose estimate_pose(const Robot& robot, const AbsoluteReadings& readings, const Pose& start);

/// Where the poses of measurements at rest are guessed.
enum class RestGuess {
  ideal,     ///< j = τlσε: Z_ideal, where the set-point, else the measured tensions, else the
             ///< lengths hold the platform
  estimated  ///< as those of measurements in motion
};

/// Where cables of the lengths that they have at a pose would let the platform hang; nothing where
/// lengths alone do not hold it, or it cannot hang there.
std::optional<Pose> hanging_near(const Robot& robot, const Pose& pose);

/// Poses of all measurements from a guess of ζ0. In motion, and at rest if asked for or where no
/// tensions hold the platform, steps 1–3 of §3.3: l0, σ0 and χ0 follow from ζ0, the changes are
/// added, and each pose is estimated from its neighbour's in the list. `known`: the poses of the
/// reference and of all rests, where they are.
std::vector<Pose> measurement_guesses(const Robot& robot,
                                      const std::vector<Measurement>& measurements,
                                      const Pose& reference_guess,
                                      const ActiveEffects& effects = {},
                                      RestGuess rests = RestGuess::estimated,
                                      const std::vector<Pose>& known = {});

/// The same problem with a platform that tilts and turns little, as one that is led between poses
/// does: where nothing reads roll, pitch or yaw, every pose keeps near the attitude of `reference`.
/// Its minimum is where to start from: without this, lengths alone have many others, the platform
/// turned over in most of them. Nothing where sensors or guides know the attitude, or tensions do.
std::optional<CalibrationProblem> kept_upright(const CalibrationProblem& problem,
                                               const Pose& reference);

}  // namespace cdprcal
