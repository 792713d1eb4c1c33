// Faults of one group of sensors that have values of their own: a zero, a mounting.
#pragma once

#include <vector>

#include "cdprcal/diagnosis/discrete.hpp"

namespace cdprcal {

/// What the attitude and the tensions read other than the remaining sensors and the balance say,
/// if that is one constant: the sensor's mounting or zero. `log`: a row a rest, at `at_s`. None of
/// a group without which nothing says where the platform is, of what is as small as an effect (a
/// mounting that is nearly right, loads that do not bear the platform), and of tensions where the
/// balance does not tell them.
std::vector<DiscreteFault> fitted_faults(const Robot& robot, const Log& log,
                                         CalibrateOptions options, const std::vector<double>& at_s);

}  // namespace cdprcal
