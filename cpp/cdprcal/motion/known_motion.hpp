// How the platform moved at moments of a run, as part of the balance there.
#pragma once

#include "cdprcal/effects/effect.hpp"
#include "cdprcal/motion/motion_state.hpp"

namespace cdprcal {

/// Twist and acceleration at one moment.
struct KnownMotion {
  double time_s = 0.0;
  Vector6 twist = Vector6::Zero();
  Vector6 acceleration = Vector6::Zero();
};

/// What holds a moving platform back: forces 2m/T v of the centre of mass, moments 2I/T ω, with T
/// the times in which a free oscillation falls to 1/e.
struct MotionDamping {
  double shift_1_s = 0.0;  ///< 1/T
  double turn_1_s = 0.0;
};
/// The wrench of unit damping of each kind (6×2), of the balance's sign.
Eigen::Matrix<double, 6, 2> damping_wrench(const Robot& robot, const PlatformState& state,
                                           const Vector6& twist);

/// An effect without values, for models that hold it as known: measurements at these very times
/// balance with M ν̇ + h(ν) (inertial_wrench.hpp) and damping, all others at rest. No effect of the
/// catalogue.
std::shared_ptr<const Effect> known_motion(std::vector<KnownMotion> moments,
                                           const MotionDamping& damping = {});

}  // namespace cdprcal
