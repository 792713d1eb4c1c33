#include "cdprcal/estimation/presence.hpp"

#include <algorithm>

namespace cdprcal {

bool is_read(const CalibrationProblem& problem, Channel channel) {
  const auto read = [channel](const Measurement& m) {
    return channel == Channel::balance ? m.in_balance()
                                       : readings_of(m, channel).array().isFinite().any();
  };
  return std::any_of(problem.measurements.begin(), problem.measurements.end(), read);
}

}  // namespace cdprcal
