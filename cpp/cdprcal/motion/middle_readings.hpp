// What is read at a moment of motion, from the samples around it.
#pragma once

#include "cdprcal/readings/measurement.hpp"

namespace cdprcal {

/// The readings at row `row`, smoothed by parabolas over `half_s` to both sides, as far as the run
/// goes to both: the middle of a Savitzky–Golay filter (1964). `samples` of the result: how many
/// single readings are worth as much. `tension_rate_N_s`: how fast tensions change there; 0 where
/// that is not known.
Measurement middle_reading(const Log& log, const SampleRange& run, Eigen::Index row, double half_s,
                           int cable_count, CableVector& tension_rate_N_s);

}  // namespace cdprcal
