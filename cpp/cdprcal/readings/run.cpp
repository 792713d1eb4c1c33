#include "cdprcal/readings/run.hpp"

#include "cdprcal/error.hpp"
#include "cdprcal/readings/log_checks.hpp"
#include "cdprcal/statistics.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {

SampleRange run_of(const Log& log, int segment) {
  const std::vector<SampleRange> all = segments(log);
  const int count = static_cast<int>(all.size());
  const Eigen::Index samples = log.sample_count();
  if (count > 1 && 2 * count > samples) {
    const double usual_s =
        (log.time_s[samples - 1] - log.time_s[0]) / static_cast<double>(samples - 1);
    throw InputError(
        name_of(log) + ": time_s advances by " + printed("%.4g s", usual_s) +
        " from one sample to the next, too far for a run; give seconds (milliseconds and "
        "nanoseconds look like that), or log at 10 Hz or more");
  }
  const int index = segment < 0 ? count - 1 : segment;
  if (segment < -1 || index >= count) {
    throw InputError(name_of(log) + ": segment " + std::to_string(segment) +
                     " asked for, but the log has " + std::to_string(count) +
                     "; give one of these, counted from 0, or -1 for the last");
  }
  return all[static_cast<std::size_t>(index)];
}

double median_step_s(const Log& log, const SampleRange& rows) {
  std::vector<double> steps;
  for (Eigen::Index row = rows.begin + 1; row < rows.end; ++row) {
    steps.push_back(log.time_s[row] - log.time_s[row - 1]);
  }
  return steps.empty() ? kNaN : median(std::move(steps));
}

void check_belongs(const Robot& robot, const Log& log) {
  const int cables = log.cable_count();
  if (log.sample_count() == 0)
    throw InputError(name_of(log) + ": the log has no samples; log again");
  if (cables == 0) {
    throw InputError(name_of(log) +
                     ": the log says nothing of any cable; log lengths, swivel angles or tensions "
                     "(length_1_m, swivel_1_rad, tension_1_N …)");
  }
  if (cables != robot.cable_count()) {
    throw InputError(name_of(log) + ": the log has " + std::to_string(cables) + " cables, robot '" +
                     robot.name + "' has " + std::to_string(robot.cable_count()) +
                     "; give the robot file that belongs to this log");
  }
  validate(log);  // it may not come from a file
}

}  // namespace cdprcal
