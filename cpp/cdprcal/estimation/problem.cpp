#include "cdprcal/estimation/problem.hpp"

#include "cdprcal/error.hpp"
#include "cdprcal/estimation/mean_square.hpp"

namespace cdprcal {

const CalibrationProblem& completed(const CalibrationProblem& problem,
                                    const std::vector<Pose>& poses,
                                    std::optional<CalibrationProblem>& filled) {
  const int n = problem.robot.cable_count();
  if (problem.measurements.empty())
    throw InputError("calibration: no measurement; give at least one");
  if (poses.size() != problem.measurements.size()) {
    throw InputError("calibration: " + std::to_string(poses.size()) + " guessed poses for " +
                     std::to_string(problem.measurements.size()) + " measurements; give one each");
  }
  for (const Measurement& m : problem.measurements) {
    if (m.length_m.size() != n || m.swivel_rad.size() != n || m.tension_N.size() != n) {
      throw InputError(
          "calibration: a measurement must have one length, swivel and tension for "
          "each of the robot's " +
          std::to_string(n) + " cables (NaN where absent)");
    }
    if (m.direct_length_m.size() != 0 && m.direct_length_m.size() != n) {
      throw InputError("calibration: a measurement has " +
                       std::to_string(m.direct_length_m.size()) + " direct lengths for " +
                       std::to_string(n) + " cables; give none, or one a cable (NaN where absent)");
    }
  }
  const bool complete =
      problem.statics != StaticsModel::left_inverse || !problem.left_inverse_rows.empty();
  if (!complete) filled.emplace(problem).left_inverse_rows = left_inverse_rows(n);
  const CalibrationProblem& out = complete ? problem : *filled;
  if (out.statics == StaticsModel::left_inverse &&
      (n > 6 || static_cast<int>(out.left_inverse_rows.size()) != n)) {
    throw InputError("calibration: " + std::to_string(out.left_inverse_rows.size()) +
                     " left_inverse_rows for " + std::to_string(n) +
                     " cables; the left inverse of eq. 12 needs one a cable, of 6 cables at most: "
                     "give these, or use wrench statics");
  }
  return out;
}

CalibrationProblem completed(const CalibrationProblem& problem, const std::vector<Pose>& poses) {
  std::optional<CalibrationProblem> filled;
  return completed(problem, poses, filled);
}

ResidualRms residual_rms(const std::vector<PoseResidual>& residuals, bool reference_attitude) {
  MeanSquare length, swivel, roll_pitch, yaw, tension, force, moment, absolute_yaw, direct,
      position;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const PoseResidual& r = residuals[i];
    if (i > 0) {  // at the reference these are zero by construction
      for (const double v : r.length_m) length.add(v);
      for (const double v : r.swivel_rad) swivel.add(v);
      yaw.add(r.roll_pitch_yaw_rad[2]);
    }
    if (i > 0 || reference_attitude) {
      roll_pitch.add(r.roll_pitch_yaw_rad[0]);
      roll_pitch.add(r.roll_pitch_yaw_rad[1]);
    }
    for (const double v : r.tension_N) tension.add(v);
    absolute_yaw.add(r.absolute_yaw_rad);
    for (const double v : r.direct_length_m) direct.add(v);
    for (const double v : r.position_m) position.add(v);
    for (int a = 0; a < 3; ++a) force.add(r.wrench[a]);
    for (int a = 3; a < 6; ++a) moment.add(r.wrench[a]);
  }
  return {{absolute_yaw.rms(), direct.rms(), position.rms()},
          length.rms(),
          swivel.rms(),
          roll_pitch.rms(),
          yaw.rms(),
          tension.rms(),
          force.rms(),
          moment.rms()};
}

}  // namespace cdprcal
