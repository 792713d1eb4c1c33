// The run of a log as the robot file sets it right.
#pragma once

#include <optional>
#include <utility>

#include "cdprcal/effects/applied.hpp"
#include "cdprcal/readings/run.hpp"

namespace cdprcal {

/// Refers to what was given where nothing is to be corrected: not to outlive it. Throws InputError
/// as check_belongs() and run_of() do.
struct CorrectedRun {
  CorrectedRun(const Robot& robot, const Log& given, int segment = -1)
      : corrected((check_belongs(robot, given), correct_readings(robot, given))),
        log(corrected ? *corrected : given),
        rows(run_of(log, segment)) {}
  /// The same rows of what `other` became; of itself where it became nothing else.
  CorrectedRun(const CorrectedRun& other, std::optional<Log> changed)
      : corrected(std::move(changed)), log(corrected ? *corrected : other.log), rows(other.rows) {}
  CorrectedRun(const CorrectedRun&) = delete;
  CorrectedRun& operator=(const CorrectedRun&) = delete;

  const std::optional<Log> corrected;
  const Log& log;
  const SampleRange rows;
};

}  // namespace cdprcal
