// What an inertial unit on the platform reads of its motion: residuals and derivatives.
#pragma once

#include "cdprcal/motion/motion_state.hpp"
#include "cdprcal/readings/measurement.hpp"

namespace cdprcal {

/// Rows of an accelerometer and of a gyroscope, in the order of inertial_rows().
inline constexpr int kInertialReadings = 6;
/// Specific force x, y, z, angular velocity x, y, z.
std::vector<RowLabel> inertial_rows();

struct InertialReadings {
  Vector6 misfit = Vector6::Constant(kNaN);  ///< model − reading; NaN where nothing was read
  Eigen::Matrix<double, kInertialReadings, kMotionUnknowns> by_state;
};

/// f = Rᵀ (v̇ + ω̇ × s + ω × (ω × s) + g e_z) at the unit's place s = R r, and ω in platform axes
/// (Titterton and Weston, Strapdown Inertial Navigation Technology, §3.5), whose axes are the
/// unit's. The specific force is left out in motion where the robot does not say where its unit
/// sits.
void evaluate(const Robot& robot, const Measurement& m, const MotionState& state,
              InertialReadings& out);

}  // namespace cdprcal
