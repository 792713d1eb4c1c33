#include "cdprcal/calibration/problem.hpp"

#include "cdprcal/error.hpp"

namespace cdprcal {

CalibrationProblem completed(const CalibrationProblem& problem, const std::vector<Pose>& poses) {
  const int n = problem.robot.cable_count();
  if (problem.measurements.empty()) throw InputError("calibration: no measurement");
  if (poses.size() != problem.measurements.size()) {
    throw InputError("calibration: " + std::to_string(poses.size()) + " guessed poses for " +
                     std::to_string(problem.measurements.size()) + " measurements");
  }
  for (const Measurement& m : problem.measurements) {
    if (m.length_m.size() != n || m.swivel_rad.size() != n || m.tension_N.size() != n) {
      throw InputError("calibration: a measurement has not one length, swivel and tension for "
                       "each of the robot's " + std::to_string(n) + " cables (NaN where absent)");
    }
  }
  CalibrationProblem out = problem;
  if (out.statics == StaticsModel::left_inverse && out.left_inverse_rows.empty()) {
    out.left_inverse_rows = left_inverse_rows(n);
  }
  return out;
}

}  // namespace cdprcal
