#include "cdprcal/estimation/reference_readings.hpp"

#include <algorithm>

namespace cdprcal {

template <typename Reading>
double ReferenceReadings::prepare(const CalibrationProblem& problem, int index,
                                  const Reading& reading) {
  const auto& measurements = problem.measurements;
  const double at_reference = reading(measurements.front());
  const auto elsewhere =
      std::find_if(measurements.begin() + 1, measurements.end(),
                   [&](const Measurement& m) { return std::isfinite(reading(m)); });
  const bool measured_elsewhere = elsewhere != measurements.end();
  const bool present = std::isfinite(at_reference);
  const auto at = static_cast<std::size_t>(index);
  free_[at] = measured_elsewhere && (problem.reference_noise || !present);
  known_[at] = free_[at] && present;
  if (present || !measured_elsewhere) return at_reference;
  return reading(*elsewhere);
}

ReferenceReadings::ReferenceReadings(const CalibrationProblem& problem)
    : cables_(problem.robot.cable_count()),
      error_(Eigen::VectorXd::Zero(2 * cables_ + 1)),
      free_(static_cast<std::size_t>(size()), 0),
      known_(static_cast<std::size_t>(size()), 0) {
  length_m.resize(cables_);
  swivel_rad.resize(cables_);
  for (int c = 0; c < cables_; ++c) {
    length_m[c] =
        prepare(problem, length_error(c), [c](const Measurement& m) { return m.length_m[c]; });
    swivel_rad[c] =
        prepare(problem, swivel_error(c), [c](const Measurement& m) { return m.swivel_rad[c]; });
  }
  yaw_rad =
      prepare(problem, yaw_error(), [](const Measurement& m) { return m.roll_pitch_yaw_rad[2]; });
}

OffsetVector ReferenceReadings::base() const {
  OffsetVector out(size());
  out << length_m, swivel_rad, yaw_rad;
  return out;
}

int ReferenceReadings::free_errors() const {
  return static_cast<int>(std::count(free_.begin(), free_.end(), 1));
}

}  // namespace cdprcal
