// The run of a log as the robot file sets it right.
#pragma once

#include <optional>
#include <utility>

#include "cdprcal/effects/applied.hpp"
#include "cdprcal/readings/outliers.hpp"
#include "cdprcal/readings/run.hpp"

namespace cdprcal {

/// What becomes of readings that stand out of those around them (readings/outliers.hpp).
enum class Outliers { kept, left_out };

/// Refers to what was given where nothing is to be corrected: not to outlive it. Throws InputError
/// as check_belongs() and run_of() do.
struct CorrectedRun {
  CorrectedRun(const Robot& robot, const Log& given, int segment = -1,
               Outliers outliers = Outliers::kept)
      : corrected(set_right(robot, given, segment, outliers)),
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

 private:
  static std::optional<Log> set_right(const Robot& robot, const Log& given, int segment,
                                      Outliers outliers) {
    check_belongs(robot, given);
    std::optional<Log> out = correct_readings(robot, given);
    if (outliers == Outliers::kept) return out;
    Log without = out ? *out : given;
    if (!leave_out_outliers(robot.sigma, run_of(without, segment), without).empty()) {
      out = std::move(without);
    }
    return out;
  }
};

}  // namespace cdprcal
