// Accelerations of moments, as far as they are more than noise.
#pragma once

#include <span>
#include <vector>

#include "cdprcal/readings/measurement.hpp"

namespace cdprcal {

/// What a mass, a centre of mass or an inertia does in motion it multiplies accelerations with, and
/// noise in these makes every one of them look smaller than it is (errors in variables). So each
/// moment's acceleration becomes what is expected of it, given how much all of them move beside
/// their noise (regression calibration: Carroll et al. 2006, ch. 4), and its inertial_sigma how
/// well that is known. `noise`: covariance of what the motion of each moment takes [N, Nm];
/// `worth`: so many moments are worth an independent one.
void shrink_accelerations(const Robot& robot, const std::vector<Pose>& poses,
                          const std::vector<Matrix6>& noise, double worth,
                          std::span<Measurement> moments);

}  // namespace cdprcal
