#include "cdprcal/estimation/presence.hpp"

#include <algorithm>

#include "cdprcal/estimation/unread_tensions.hpp"

namespace cdprcal {

bool is_read(const CalibrationProblem& problem, Channel channel) {
  const auto read = [&problem, channel](const Measurement& m) {
    return channel == Channel::balance ? balance_equations(problem.robot, m) > 0
                                       : readings_of(m, channel).array().isFinite().any();
  };
  return std::any_of(problem.measurements.begin(), problem.measurements.end(), read);
}

bool reads_tensions(const std::vector<Measurement>& measurements) {
  return std::ranges::any_of(
      measurements, [](const Measurement& m) { return m.tension_N.array().isFinite().any(); });
}

}  // namespace cdprcal
