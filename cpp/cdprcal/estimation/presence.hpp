// Which sensors a problem has readings of.
#pragma once

#include "cdprcal/estimation/model.hpp"
#include "cdprcal/estimation/problem.hpp"
#include "cdprcal/readings/channel.hpp"

namespace cdprcal {

/// Whether any measurement holds a reading of this channel; of a balance: of its tensions.
bool is_read(const std::vector<Measurement>& measurements, Channel channel);
/// The same, but a balance is read where its rest poses an equation, with load cells or without.
bool is_read(const CalibrationProblem& problem, Channel channel);

/// The same, in any run.
bool is_read(const DiagnosisModel& model, Channel channel);

/// Whether any load cell was read.
bool reads_tensions(const std::vector<Measurement>& measurements);
/// The same, in any run.
bool reads_tensions(const DiagnosisModel& model);

}  // namespace cdprcal
