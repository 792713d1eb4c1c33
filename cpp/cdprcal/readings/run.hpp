// Which part of a log is the run, of this robot.
#pragma once

#include "cdprcal/model/robot.hpp"
#include "cdprcal/readings/log.hpp"

namespace cdprcal {

/// The samples of one segment, from 0; −1: the last. Throws InputError for one that the log does
/// not have, and for times that are no seconds: nearly every sample a segment of its own.
SampleRange run_of(const Log& log, int segment);

/// From one sample to the next, as most are apart; NaN of a single one.
double median_step_s(const Log& log, const SampleRange& rows);

/// Throws InputError for a log without samples, or of another number of cables than the robot.
void check_belongs(const Robot& robot, const Log& log);

}  // namespace cdprcal
