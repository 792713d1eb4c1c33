#include "cdprcal/motion/late_readings.hpp"

#include <algorithm>
#include <cmath>

#include "cdprcal/readings/run.hpp"

namespace cdprcal {
namespace {

/// Any channel of a sensor.
Channel one_of(const Sensor& sensor) { return channel_of(channels_of(sensor).front()); }

/// What effects make of the balance by the rate of the tensions [s]: T where load cells come T
/// late.
double balance_by_rate(const Robot& robot, const ActiveEffects& effects, const Measurement& at,
                       const Pose& pose) {
  Measurement m = at;
  m.tension_N.setZero(robot.cable_count());
  const auto upward = [&](double rising_N_s) {
    m.rising_wrench = rising_N_s * Vector6::Unit(2);
    PoseEvaluation out;
    evaluate_pose(robot, m, pose, StaticsModel::wrench, {}, effects, false, out);
    return out.wrench[2];
  };
  return upward(1.0) - upward(0.0);
}

/// Delays as effects have them [s].
SensorTimes delays_s(const Calibration& calibration) {
  SensorTimes out;
  const CalibrationProblem& problem = calibration.problem;
  if (problem.effects.empty() || problem.measurements.empty()) return out;
  const Robot robot = with_effects(problem.robot, problem.effects);
  const Measurement& at = problem.measurements.front();
  const Pose& pose = calibration.result.poses.front();
  const ReadingVector by_rate = by_own_rate(robot, problem.effects, at, pose);
  const std::vector<RowLabel> labels = geometric_rows(robot.cable_count());
  SensorTimes readings;
  for (std::size_t r = 0; r < labels.size(); ++r) {
    double& mean = out[labels[r].channel];
    mean += (-by_rate[static_cast<Eigen::Index>(r)] - mean) / ++readings[labels[r].channel];
  }
  out[Channel::balance] = balance_by_rate(robot, problem.effects, at, pose);
  return out;
}

/// The same in whole samples; nothing comes before it is so.
SensorTimes whole_samples_s(const Calibration& calibration, const CorrectedRun& run) {
  SensorTimes out = delays_s(calibration);
  if (!out.any()) return out;
  const double each_s = median_step_s(run.log, run.rows);
  for_each_sensor(
      [&](const Sensor& sensor, const LogMatrix& read) {
        double& delay_s = out[one_of(sensor)];
        const bool late = read.cols() > 0 && delay_s > 0.5 * each_s;
        delay_s = late ? each_s * std::round(delay_s / each_s) : 0.0;
      },
      run.log);
  return out;
}

/// Of each row, the one so much later; −1 where there is none.
std::vector<Eigen::Index> rows_later(const CorrectedRun& run, double ahead_s) {
  std::vector<Eigen::Index> out;
  const double within_s = 0.51 * median_step_s(run.log, run.rows);  // the nearest, rounding apart
  Eigen::Index next = run.rows.begin;
  for (Eigen::Index row = run.rows.begin; row < run.rows.end; ++row) {
    const double wanted_s = run.log.time_s[row] + ahead_s;
    const auto away_s = [&](Eigen::Index other) {
      return std::abs(run.log.time_s[other] - wanted_s);
    };
    while (next + 1 < run.rows.end && away_s(next + 1) <= away_s(next)) ++next;
    out.push_back(away_s(next) <= within_s ? next : -1);
  }
  return out;
}

std::optional<Log> read_later(const CorrectedRun& run, const SensorTimes& ahead_s) {
  if (!ahead_s.any()) return std::nullopt;
  Log out = run.log;
  for_each_sensor(
      [&](const Sensor& sensor, const LogMatrix& read, LogMatrix& later) {
        const double by_s = ahead_s[one_of(sensor)];
        if (by_s == 0.0) return;
        Eigen::Index row = run.rows.begin;
        for (const Eigen::Index from : rows_later(run, by_s)) {
          if (from >= 0) {
            later.row(row) = read.row(from);
          } else {
            later.row(row).setConstant(kNaN);
          }
          ++row;
        }
      },
      run.log, out);
  return out;
}

}  // namespace

ReadingVector by_own_rate(const Robot& robot, const ActiveEffects& effects, const Measurement& at,
                          const Pose& pose) {
  const int n = robot.cable_count();
  ReadingVector out = ReadingVector::Zero(static_cast<Eigen::Index>(geometric_rows(n).size()));
  Measurement m = at;
  const auto model_at = [&] {
    GeometricReadings read;
    evaluate(robot, effects, m, pose, read);
    return read.model;
  };
  const auto none = [&] {
    m.length_rate_m_s.setZero(n);
    m.swivel_rate_rad_s.setZero(n);
    m.attitude_rate_rad_s.setZero();
  };
  none();
  const PoseEvaluation still = model_at();
  m.length_rate_m_s.setOnes();
  out.head(n) = model_at().length_m - still.length_m;
  none();
  m.swivel_rate_rad_s.setOnes();
  out.segment(n, n) = model_at().swivel_rad - still.swivel_rad;
  for (int axis = 0; axis < 3; ++axis) {
    none();
    m.attitude_rate_rad_s[axis] = 1.0;
    out[2 * n + axis] = model_at().roll_pitch_yaw_rad[axis] - still.roll_pitch_yaw_rad[axis];
  }
  return out;
}

LateReadings::LateReadings(const Calibration& calibration, const CorrectedRun& given)
    : ahead_s(whole_samples_s(calibration, given)), run(given, read_later(given, ahead_s)) {}

}  // namespace cdprcal
