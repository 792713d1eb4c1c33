#include "cdprcal/estimation/presence.hpp"

#include <algorithm>
#include <cmath>

namespace cdprcal {

bool is_read(const CalibrationProblem& problem, Channel channel) {
  const auto read = [channel](const Measurement& m) {
    switch (channel) {
      case Channel::length:
        return m.length_m.array().isFinite().any();
      case Channel::swivel:
        return m.swivel_rad.array().isFinite().any();
      case Channel::roll_pitch:
        return m.roll_pitch_yaw_rad.head<2>().array().isFinite().any();
      case Channel::yaw:
        return std::isfinite(m.roll_pitch_yaw_rad[2]);
      case Channel::balance:
        return m.in_balance();
      case Channel::absolute_yaw:
        return std::isfinite(m.absolute_yaw_rad);
      case Channel::direct_length:
        return m.direct_length_m.array().isFinite().any();
      case Channel::position:
        return m.position_m.array().isFinite().any();
    }
    return false;
  };
  return std::any_of(problem.measurements.begin(), problem.measurements.end(), read);
}

}  // namespace cdprcal
