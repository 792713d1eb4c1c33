// The way of a platform whose whole pose is led by the lengths of six cables and more.
//
// Positions run along the straight line, the rotation about one axis at one rate; the tensions are
// those in balance that are closest to the straight line between the ends' tensions. So a way is
// known from its ends alone, to who plans it and to who drives it.
#pragma once

#include <vector>

#include "cdprcal/equilibria/wrench_distribution.hpp"

namespace cdprcal {

struct HeldMotion {
  Pose from;
  Vector6 twist = Vector6::Zero();  ///< to ⊖ from: dζ/ds, the same all the way
  CableVector from_N, change_N;

  HeldMotion() = default;
  HeldMotion(const Pose& from_pose, const CableVector& from_tension_N, const Pose& to_pose,
             const CableVector& to_tension_N)
      : from(from_pose),
        twist(minus(to_pose, from_pose)),
        from_N(from_tension_N),
        change_N(to_tension_N - from_tension_N) {}
};

/// One point of the way, at a fraction s of it in [0, 1].
struct HeldPoint {
  Pose pose;
  PlatformState state;
  CableVector tension_N;  ///< empty: the cables do not hold the platform there
};
HeldPoint held_point(const Robot& robot, const HeldMotion& motion, double s);

/// Shortest time [s] of a fifth-degree transition along a motion in which accelerations take no
/// cable more than an eighth of its pull. Cables that follow tensions give nothing, so that others
/// give up to twice as much, and what drives do not follow at once comes on top.
double least_time_by_tension_s(const Robot& robot, const HeldMotion& motion);

/// Which n−6 cables follow tensions while the lengths of the other six hold the pose: those with
/// which the remaining tensions are governed best at the pose where they are governed least. From
/// 0, rising; empty for six cables. `present`: those that do now go on unless others govern twice
/// as well, since a change of roles disturbs. Throws InputError where no six cables hold all poses.
std::vector<int> cables_led_by_tension(const Robot& robot, const std::vector<Pose>& poses,
                                       const std::vector<int>& present = {});

}  // namespace cdprcal
