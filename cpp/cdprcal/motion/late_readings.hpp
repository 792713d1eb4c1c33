// Readings that are known to come late, read when they come.
#pragma once

#include <algorithm>
#include <array>

#include "cdprcal/calibration/calibrate.hpp"
#include "cdprcal/effects/corrected_run.hpp"
#include "cdprcal/motion/geometric_readings.hpp"

namespace cdprcal {

/// A time for each sensor of kSensorTable, which any of its channels stands for [s].
struct SensorTimes {
  std::array<double, kSensors> all_s{};
  double& operator[](Channel of) { return all_s[static_cast<std::size_t>(row_of(of).sensor)]; }
  double operator[](Channel of) const { return all_s[static_cast<std::size_t>(row_of(of).sensor)]; }
  [[nodiscard]] bool any() const {
    return std::ranges::any_of(all_s, [](double s) { return s != 0.0; });
  }
};

/// What effects make of each geometric reading, by its own rate [s]: −T where it comes T late.
ReadingVector by_own_rate(const Robot& robot, const ActiveEffects& effects, const Measurement& at,
                          const Pose& pose);

/// A run whose readings are those read later, by as many whole samples as the effects of a
/// calibration make their sensor late. An effect of a reading's rate is the first term of a series,
/// and a swing has turned back in a delay that is no small part of its period; what is left of the
/// delay is at most half a sample. A reading is NaN where nothing follows.
struct LateReadings {
  LateReadings(const Calibration& calibration, const CorrectedRun& run);
  LateReadings(const LateReadings&) = delete;
  LateReadings& operator=(const LateReadings&) = delete;

  const SensorTimes ahead_s;  ///< how much later they are read
  const CorrectedRun run;
};

}  // namespace cdprcal
