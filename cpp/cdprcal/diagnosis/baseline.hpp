// The diagnosis' starting point: every log as a run, its readings' ripple, nothing added yet.
#pragma once

#include "cdprcal/estimation/model.hpp"

namespace cdprcal {

/// All logs calibrated and fitted together with no effect beyond those the robot file lists.
/// `motion`: moments at which the platform moves count as rests do (calibrate_in_motion), where the
/// balance explains them. Readings left out are described in `left_out`. Throws InputError for a
/// log that does not fit the robot or cannot be calibrated at all. Outliers come back as NaN in
/// `logs`.
DiagnosisModel baseline_model(const Robot& robot, std::vector<Log>& logs,
                              std::vector<std::string>& left_out, bool motion = false);

}  // namespace cdprcal
