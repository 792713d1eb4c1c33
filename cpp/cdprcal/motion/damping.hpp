// What holds a moving platform back.
#pragma once

#include "cdprcal/effects/effect.hpp"

namespace cdprcal {

/// Forces 2m/T v of the centre of mass, moments 2I/T ω, with T the times in which a free
/// oscillation falls to 1/e.
struct MotionDamping {
  double shift_1_s = 0.0;  ///< 1/T
  double turn_1_s = 0.0;
};
/// The wrench of unit damping of each kind (6×2), of the balance's sign.
Eigen::Matrix<double, 6, 2> damping_wrench(const Robot& robot, const PlatformState& state,
                                           const Vector6& twist);

/// An effect without values, for models that hold the damping as known. No effect of the catalogue:
/// every platform has some, and no robot file says how much.
std::shared_ptr<const Effect> known_damping(const MotionDamping& damping);

}  // namespace cdprcal
