#include "cdprcal/motion/late_attitude.hpp"

#include <algorithm>
#include <cmath>

#include "cdprcal/motion/geometric_readings.hpp"
#include "cdprcal/readings/run.hpp"

namespace cdprcal {
namespace {

/// A delay in whole samples [s]; nothing comes before it is so.
double whole_samples_s(double delay_s, const CorrectedRun& run) {
  if (run.log.roll_pitch_yaw_rad.cols() == 0 || !(delay_s > 0.0)) return 0.0;
  const double each_s = median_step_s(run.log, run.rows);
  return delay_s > 0.5 * each_s ? each_s * std::round(delay_s / each_s) : 0.0;
}

double delay_s(const Calibration& calibration) {
  const CalibrationProblem& problem = calibration.problem;
  if (problem.effects.empty() || problem.measurements.empty()) return 0.0;
  return -attitude_by_rate(with_effects(problem.robot, problem.effects), problem.effects,
                           problem.measurements.front(), calibration.result.poses.front())
              .trace() /
         3.0;
}

std::optional<Log> read_later(const CorrectedRun& run, double ahead_s) {
  if (!(ahead_s > 0.0)) return std::nullopt;
  Log out = run.log;
  const double within_s = 0.51 * median_step_s(run.log, run.rows);  // the nearest, rounding apart
  Eigen::Index next = run.rows.begin;
  for (Eigen::Index row = run.rows.begin; row < run.rows.end; ++row) {
    const double wanted_s = run.log.time_s[row] + ahead_s;
    const auto away_s = [&](Eigen::Index other) {
      return std::abs(run.log.time_s[other] - wanted_s);
    };
    while (next + 1 < run.rows.end && away_s(next + 1) <= away_s(next)) ++next;
    if (away_s(next) <= within_s) {
      out.roll_pitch_yaw_rad.row(row) = run.log.roll_pitch_yaw_rad.row(next);
    } else {
      out.roll_pitch_yaw_rad.row(row).setConstant(kNaN);
    }
  }
  return out;
}

}  // namespace

Matrix3 attitude_by_rate(const Robot& robot, const ActiveEffects& effects, const Measurement& at,
                         const Pose& pose) {
  const auto attitude_at = [&](const Vector3& rate_rad_s) -> Vector3 {
    Measurement m = at;
    m.attitude_rate_rad_s = rate_rad_s;
    GeometricReadings out;
    evaluate(robot, effects, m, pose, out);
    return out.model.roll_pitch_yaw_rad;
  };
  const Vector3 still = attitude_at(Vector3::Zero());
  Matrix3 out;
  for (int axis = 0; axis < 3; ++axis) {
    out.col(axis) = attitude_at(Vector3::Unit(axis)) - still;
  }
  return out;
}

LateAttitudes::LateAttitudes(const Calibration& calibration, const CorrectedRun& given)
    : ahead_s(whole_samples_s(delay_s(calibration), given)),
      run(given, read_later(given, ahead_s)) {}

}  // namespace cdprcal
