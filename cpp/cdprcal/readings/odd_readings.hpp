// Single readings that no motion of a platform makes: a lost bit, a loose plug.
#pragma once

#include <vector>

#include "cdprcal/readings/measurement.hpp"

namespace cdprcal {

/// Whether a value is further than `least` from both the one before and the one after, on the same
/// side of them. NaN: nothing is known.
bool stands_out(double before, double value, double after, double least);

/// Takes out of the readings of a rest, in their order, those that stand out by more than six
/// standard deviations of most of them. What creeps stays; so does all of few, and where most are
/// alike and nothing tells.
void leave_out_odd(std::vector<double>& at_rest);

/// Readings of one moment of a motion that would take a larger acceleration than gravity's to be
/// true: NaN instead. `lever_m`: of gravity on the platform's rotations. Tensions, which jump,
/// stay.
void leave_out_impossible(const Log& log, Eigen::Index row, double gravity_m_s2, double lever_m,
                          Measurement& m);

}  // namespace cdprcal
