#include "cdprcal/estimation/presence.hpp"

#include <algorithm>

#include "cdprcal/estimation/unread_tensions.hpp"

namespace cdprcal {

bool is_read(const std::vector<Measurement>& measurements, Channel channel) {
  return std::ranges::any_of(measurements, [channel](const Measurement& m) {
    return readings_of(m, channel).array().isFinite().any();
  });
}

bool is_read(const CalibrationProblem& problem, Channel channel) {
  if (channel != Channel::balance) return is_read(problem.measurements, channel);
  return std::ranges::any_of(problem.measurements, [&](const Measurement& m) {
    return balance_equations(problem.robot, m) > 0;
  });
}

bool reads_tensions(const std::vector<Measurement>& measurements) {
  return is_read(measurements, Channel::balance);
}

bool is_read(const DiagnosisModel& model, Channel channel) {
  return std::ranges::any_of(model.runs, [channel](const DiagnosisRun& run) {
    return is_read(run.measurements, channel);
  });
}

bool reads_tensions(const DiagnosisModel& model) { return is_read(model, Channel::balance); }

}  // namespace cdprcal
