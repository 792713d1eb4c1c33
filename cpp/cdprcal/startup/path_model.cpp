#include "cdprcal/startup/path_model.hpp"

#include <Eigen/LU>
#include <algorithm>

#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/geometry/fifth_degree.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/statics/natural_frequencies.hpp"

namespace cdprcal {
namespace {

PathNode node_at(const Robot& robot, const Pose& pose, const CableVector& tension_N) {
  const PlatformState state = platform_state(robot, pose);
  // Along the motion that the platform has: a guided one gives way in no other direction.
  const TwistBasis basis = motion_basis(robot);
  const Eigen::MatrixXd j = length_jacobian(state) * basis;
  const auto answer = [&](const Matrix6& resists) -> CableMatrix {
    const Eigen::MatrixXd along = basis.transpose() * resists * basis;
    return j * along.partialPivLu().solve(j.transpose());
  };
  const Matrix6 k = stiffness(robot, state, tension_N);
  PathNode node;
  node.pose = pose;
  const CableMatrix flexibility = answer(0.5 * (k + k.transpose()));
  node.flexibility_m_N = 0.5 * (flexibility + flexibility.transpose());
  node.mobility_1_kg = answer(mass_matrix(robot, state));
  const double slowest_hz =
      constant_tension_modes(robot, state, tension_N).natural_frequency_hz.minCoeff();
  node.slowest_rad_s = 2.0 * kPi * slowest_hz;
  node.mean_length_m = state.length_m().mean();
  return node;
}

/// Calls blend(i, f) with the node before s and the share of the one after.
template <class Blend>
auto between(std::size_t count, double s, const Blend& blend) {
  const double at = std::clamp(s, 0.0, 1.0) * static_cast<double>(count - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), count < 2 ? 0 : count - 2);
  return blend(i, std::min(i + 1, count - 1), at - static_cast<double>(i));
}

}  // namespace

CableMatrix PathLeg::flexibility_m_N(double s) const {
  return between(nodes.size(), s, [&](std::size_t i, std::size_t j, double f) -> CableMatrix {
    return (1.0 - f) * nodes[i].flexibility_m_N + f * nodes[j].flexibility_m_N;
  });
}

CableMatrix PathLeg::mobility_1_kg(double s) const {
  return between(nodes.size(), s, [&](std::size_t i, std::size_t j, double f) -> CableMatrix {
    return (1.0 - f) * nodes[i].mobility_1_kg + f * nodes[j].mobility_1_kg;
  });
}

double PathLeg::slowest_rad_s() const {
  double slowest = nodes.front().slowest_rad_s;
  for (const PathNode& node : nodes) slowest = std::min(slowest, node.slowest_rad_s);
  return slowest;
}

double PathLeg::mean_length_m() const {
  double sum = 0.0;
  for (const PathNode& node : nodes) sum += node.mean_length_m;
  return sum / static_cast<double>(nodes.size());
}

PathResult follow_equilibrium(const Robot& robot, const CableVector& a_N, const CableVector& b_N,
                              const std::optional<Pose>& start, int nodes) {
  PathResult result;
  result.leg.change_N = b_N - a_N;
  std::optional<Pose> previous = start;
  for (int i = 0; i < nodes; ++i) {
    const double s = static_cast<double>(i) / std::max(1, nodes - 1);
    const CableVector tension = a_N + s * (b_N - a_N);
    const EquilibriumResult rest = direct_from_tensions(robot, tension, previous);
    if (rest.status != EquilibriumStatus::found) {
      result.reason = rest.reason;
      return result;
    }
    result.leg.nodes.push_back(node_at(robot, rest.pose, tension));
    previous = rest.pose;
  }
  result.found = true;
  return result;
}

double transition_time_s(const PathLeg& leg, double velocity_m_s) {
  // Fifth degree: speed 30 s²(1−s)² of the fraction of time s; the path fraction is its integral.
  double fastest = 0.0;
  constexpr int kPoints = 40;
  for (int i = 1; i < kPoints; ++i) {
    const double x = static_cast<double>(i) / kPoints;
    const double speed = FifthDegree::velocity(x);
    fastest = std::max(
        fastest, speed * leg.length_by_fraction_m(FifthDegree::value(x)).cwiseAbs().maxCoeff());
  }
  constexpr double kPeriods = 1.5;
  return std::max(fastest / velocity_m_s, kPeriods * 2.0 * kPi / leg.slowest_rad_s());
}

}  // namespace cdprcal
