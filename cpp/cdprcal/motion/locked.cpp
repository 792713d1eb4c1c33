#include "cdprcal/motion/locked.hpp"

#include <algorithm>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/effects/applied.hpp"
#include "cdprcal/readings/turn_over.hpp"

namespace cdprcal {

std::vector<LockedStretch> locked_stretches(
    const Calibration& calibration, const CorrectedRun& run, std::span<const SmoothedSample> path,
    const std::function<bool(std::size_t begin, std::size_t sample)>& goes_on) {
  constexpr double kNoise = 10.0;  // what readings that stay range over, in their σ
  const Robot& robot = calibration.problem.robot;
  const double noise_m = calibration.signals[static_cast<std::size_t>(Channel::length)].sigma;
  const double still_m = turn_over_m(robot) + kNoise * noise_m;
  const LogMatrix& length_m = run.log.length_m;
  std::vector<LockedStretch> out;
  if (length_m.cols() == 0) return out;
  const auto row = [&](std::size_t i) {
    return length_m.row(run.rows.begin + static_cast<Eigen::Index>(i));
  };
  for (std::size_t begin = 0, next = 0; begin < path.size(); begin = std::max(next, begin + 1)) {
    Eigen::RowVectorXd low = row(begin), high = low;
    for (next = begin + 1; next < path.size(); ++next) {
      if (!path[next].state.pose.position_m.allFinite() || !goes_on(begin, next)) break;
      low = low.cwiseMin(row(next));
      high = high.cwiseMax(row(next));
      if (!((high - low).maxCoeff() <= still_m)) break;
    }
    out.push_back({begin, next});
  }
  return out;
}

bool is_resting(const Calibration& calibration, double time_s, double around_s) {
  return std::ranges::any_of(calibration.equilibria, [&](const Equilibrium& rest) {
    return time_s >= rest.begin_s - around_s && time_s <= rest.end_s + around_s;
  });
}

Modes modes_at(const Robot& robot, const Pose& pose) {
  const PlatformState state = platform_state(robot, pose);
  if (!state.valid) return {};
  const CableVector tension_N = least_norm(Eigen::MatrixXd(structure_matrix(state)),
                                           Eigen::VectorXd(gravity_wrench(robot, state)));
  return free_motion_modes(robot, state, tension_N);
}

}  // namespace cdprcal
