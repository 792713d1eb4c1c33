#include "cdprcal/estimation/problem.hpp"

#include <algorithm>

#include "cdprcal/error.hpp"
#include "cdprcal/estimation/mean_square.hpp"
#include "cdprcal/estimation/presence.hpp"

namespace cdprcal {
namespace {

/// Whether every number of the robot that a fit looks at can be one; the σ of what is not read may
/// be anything. Cheaper than `finalise`, for solves of a tenth of a millisecond.
bool is_usable(const CalibrationProblem& problem) {
  const Robot& robot = problem.robot;
  const auto number = [](double v) { return std::isfinite(v); };
  const auto of_a_cable = [&](const Cable& cable) {
    const Pulley& pulley = cable.pulley;
    return number(pulley.radius_m) && pulley.radius_m >= 0.0 && pulley.position_m.allFinite() &&
           pulley.axes_world.allFinite() && !pulley.x_axis().isZero(0.0) &&
           !pulley.swivel_axis().isZero(0.0) && cable.platform_anchor_m.allFinite();
  };
  const auto of_a_channel = [&](const ChannelRow& row) {
    const double sigma = robot.sigma.*row.of().sigma;
    return (number(sigma) && sigma > 0.0) || !is_read(problem, channel_of(row));
  };
  return robot.cable_count() >= 1 && robot.cable_count() <= kMaxCables &&
         number(robot.gravity_m_s2) && number(robot.platform.mass_kg) &&
         robot.platform.mass_kg > 0.0 && robot.platform.centre_of_mass_m.allFinite() &&
         number(robot.sigma.wrench_force_N) && robot.sigma.wrench_force_N >= 0.0 &&
         number(robot.sigma.wrench_moment_Nm) && robot.sigma.wrench_moment_Nm >= 0.0 &&
         std::ranges::all_of(robot.cables, of_a_cable) &&
         std::ranges::all_of(kChannelTable, of_a_channel);
}

/// Throws InputError for a robot or effects that no fit can be made with.
void check_robot_and_effects(const CalibrationProblem& problem) {
  const int n = problem.robot.cable_count();
  if (!is_usable(problem)) {
    Robot checked = problem.robot;
    finalise(checked);  // names the field
  }
  for (const ActiveEffect& active : problem.effects) {
    if (!active.effect) {
      throw InputError("calibration: effects: one of them is a null pointer; leave it out");
    }
    if (active.values.size() == active.effect->size(n)) continue;
    throw InputError("calibration: effects: " + active.effect->name() + " has " +
                     std::to_string(active.values.size()) + " values; give the " +
                     std::to_string(active.effect->size(n)) + " of a robot with " +
                     std::to_string(n) + " cables");
  }
}

}  // namespace

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
  check_robot_and_effects(problem);
  for (const Measurement& m : problem.measurements) {
    if (m.length_m.size() != n || m.swivel_rad.size() != n || m.tension_N.size() != n) {
      throw InputError(
          "calibration: a measurement must have one length, swivel and tension for "
          "each of the robot's " +
          std::to_string(n) + " cables (NaN where absent)");
    }
    for_each_absolute(
        [n](const Sensor& sensor, const auto& field) {
          const auto size = static_cast<int>(numbers(field).size());
          if (sensor.width != kOneACable || size == 0 || size == n) return;
          throw InputError("calibration: a measurement has " + std::to_string(size) + " " +
                           sensor.in_words + "s for " + std::to_string(n) +
                           " cables; give none, or one a cable (NaN where absent)");
        },
        m);
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
  std::array<MeanSquare, kChannels> sums;
  MeanSquare force, moment;
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const PoseResidual& r = residuals[i];
    for_each_sensor(
        [&](const Sensor& sensor, const auto& field) {
          const auto values = numbers(field);
          for (const ChannelRow& row : channels_of(sensor)) {
            // At the reference changes are zero by construction.
            const bool attitude = channel_of(row) == Channel::roll_pitch;
            if (i == 0 && (row.has_offset || (attitude && !reference_attitude))) continue;
            const auto first = static_cast<std::size_t>(row.first);
            const auto end = std::min(values.size(), first + static_cast<std::size_t>(row.count));
            for (std::size_t k = first; k < end; ++k)
              sums[static_cast<std::size_t>(channel_of(row))].add(values[k]);
          }
        },
        r);
    for (int a = 0; a < 3; ++a) force.add(r.wrench[a]);
    for (int a = 3; a < 6; ++a) moment.add(r.wrench[a]);
  }
  ResidualRms out;
  for_each_channel(
      [&](const ChannelRow& row, double& rms) {
        rms = sums[static_cast<std::size_t>(channel_of(row))].rms();
      },
      out);
  out.wrench_force_N = force.rms();
  out.wrench_moment_Nm = moment.rms();
  return out;
}

SolveOptions loosened(SolveOptions options, double function_tolerance, double settled) {
  options.function_tolerance = std::max(options.function_tolerance, function_tolerance);
  options.parameter_tolerance = std::max(options.parameter_tolerance, 0.1 * function_tolerance);
  options.settled = std::max(options.settled, settled);
  return options;
}

}  // namespace cdprcal
