// What follows where the pulleys are of another size than the robot file says.
#pragma once

#include <algorithm>

#include "cdprcal/effects/effect.hpp"

namespace cdprcal {

/// Changes each pulley's radius by its error [m], to no less than an eyelet's.
inline void add_to_radii(const EffectValues& error_m, Robot& robot) {
  for (int i = 0; i < robot.cable_count(); ++i) {
    double& radius_m = robot.cables[i].pulley.radius_m;
    radius_m = std::max(0.0, radius_m + error_m[i]);
  }
}

/// Derivatives of readings and balance by the radii (eqs 3–5): ReadingRows × n. Writes into a
/// zeroed matrix.
inline void columns_of_pulley_radii(const EffectContext& context, EffectColumns out) {
  const ReadingRows rows{context.state.cable_count};
  for (int i = 0; i < rows.cables; ++i) {
    const CableDerivatives d =
        cable_derivatives(context.robot.cables[i].pulley, context.state.cable[i]);
    out(rows.length() + i, i) = d.length_by_radius;
    const Vector3 force = context.tension_N[i] * d.direction_by_radius;
    out.col(i).segment<3>(rows.wrench()) = force;
    out.col(i).segment<3>(rows.wrench() + 3) = context.state.anchor_arm_m[i].cross(force);
  }
}

}  // namespace cdprcal
