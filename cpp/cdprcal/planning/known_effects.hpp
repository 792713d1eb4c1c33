// The effects that a robot file lists, in plans: where the platform really settles, and what the
// load cells really read there.
#pragma once

#include <optional>

#include "cdprcal/effects/applied.hpp"
#include "cdprcal/planning/plan.hpp"

namespace cdprcal {

/// Known effects of every run of a robot (resolve_effects), as planning sees them.
class KnownEffects {
 public:
  /// Throws InputError as resolve_effects does.
  explicit KnownEffects(const Robot& robot);

  /// The robot with their geometry and inertia, its list of effects empty: nothing applies twice.
  [[nodiscard]] const Robot& robot() const { return robot_; }
  /// Whether there are any that change more than the robot itself.
  [[nodiscard]] bool any() const { return !effects_.empty(); }

  /// What the load cells read when the cables pull so at a pose, and back. Effects that depend on
  /// the direction of motion or on time do nothing here. Needs a valid geometry at the pose.
  [[nodiscard]] CableVector reading_N(const Pose& pose, const CableVector& tension_N) const;
  [[nodiscard]] CableVector tension_N(const Pose& pose, const CableVector& reading_N) const;

  /// Where the platform rests when the load cells are held at these readings, close to a pose: all
  /// six equations with all effects, an external force too. Nothing when Newton does not settle.
  /// From six cables on lengths hold the platform: at the pose itself.
  [[nodiscard]] std::optional<Pose> settled(const CableVector& reading_N, const Pose& near) const;

  /// The set-point as it was planned, from a stop of a finished plan (readings, settled pose): true
  /// tensions, and where they hold the platform without forces but its weight. Nothing when they
  /// do not.
  [[nodiscard]] std::optional<SetPoint> as_planned(const SetPoint& stop) const;

 private:
  Robot robot_;
  ActiveEffects effects_;
};

/// Turns a plan of true tensions into one of readings (tension_N) at the poses where the platform
/// settles. False when some stop has none; `reason` says which.
bool apply_known_effects(const KnownEffects& effects, Plan& plan, std::string& reason);

}  // namespace cdprcal
