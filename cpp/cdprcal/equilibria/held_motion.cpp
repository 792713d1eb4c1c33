#include "cdprcal/equilibria/held_motion.hpp"

#include <Eigen/LU>
#include <algorithm>

#include "cdprcal/error.hpp"
#include "cdprcal/geometry/fifth_degree.hpp"
#include "cdprcal/statics/inertial_wrench.hpp"

namespace cdprcal {

HeldPoint held_point(const Robot& robot, const HeldMotion& motion, double s) {
  HeldPoint point;
  point.pose = plus(motion.from, s * motion.twist);
  point.state = platform_state(robot, point.pose);
  point.tension_N = balanced_near(robot, point.state, motion.from_N + s * motion.change_N);
  return point;
}

double least_time_by_tension_s(const Robot& robot, const HeldMotion& motion) {
  constexpr double kShare = 0.125;
  constexpr int kPoints = 20;
  double least_s = 0.0;
  for (int k = 0; k <= kPoints; ++k) {
    const double x = static_cast<double>(k) / kPoints;
    const HeldPoint at = held_point(robot, motion, FifthDegree::value(x));
    const CableVector change_N = tensions_of_least_norm(
        robot, at.state,
        FifthDegree::acceleration(x) * (mass_matrix(robot, at.state) * motion.twist));
    if (change_N.size() != at.tension_N.size()) continue;
    for (Eigen::Index c = 0; c < change_N.size(); ++c) {
      least_s = std::max(least_s, std::sqrt(std::abs(change_N[c]) / (kShare * at.tension_N[c])));
    }
  }
  return least_s;
}

std::vector<int> cables_led_by_tension(const Robot& robot, const std::vector<Pose>& poses,
                                       const std::vector<int>& present) {
  const int n = robot.cable_count();
  const int free = n - cables_that_hold(robot);
  if (free <= 0) return {};
  std::vector<NullBasis> bases;
  for (const Pose& pose : poses) {
    const TensionFamily family = wrench_family(robot, platform_state(robot, pose));
    if (family.valid) bases.push_back(family.basis);
  }
  // |det| of the rows of N: 1 when these tensions are λ itself, 0 when they do not govern it.
  const auto governed = [&](const std::vector<int>& cables) {
    double least = HUGE_VAL;
    for (const NullBasis& basis : bases) {
      const double by = free == 1 ? basis(cables[0], 0)
                                  : basis(cables[0], 0) * basis(cables[1], 1) -
                                        basis(cables[0], 1) * basis(cables[1], 0);
      least = std::min(least, std::abs(by));
    }
    return least;
  };
  std::vector<int> best;
  double best_by = 1e-6;
  const auto consider = [&](const std::vector<int>& cables) {
    const double by = governed(cables);
    if (by > best_by * (1.0 + 1e-9)) {
      best_by = by;
      best = cables;
    }
  };
  for (int a = 0; a < n; ++a) {
    if (free == 1) consider({a});
    for (int b = a + 1; free == 2 && b < n; ++b) consider({a, b});
  }
  if (bases.empty() || best.empty()) {
    throw InputError("no " + std::to_string(cables_that_hold(robot)) + " cables of " + robot.name +
                     " hold the platform at all poses of the plan; make a plan in a smaller box");
  }
  constexpr double kWorthAChange = 2.0;
  if (present.size() == best.size() && kWorthAChange * governed(present) >= best_by) return present;
  return best;
}

}  // namespace cdprcal
