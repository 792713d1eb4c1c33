#include "cdprcal/equilibria/held_motion.hpp"

#include <Eigen/LU>
#include <algorithm>

#include "cdprcal/error.hpp"

namespace cdprcal {

HeldPoint held_point(const Robot& robot, const HeldMotion& motion, double s) {
  HeldPoint point;
  point.pose = plus(motion.from, s * motion.twist);
  point.state = platform_state(robot, point.pose);
  point.tension_N = balanced_near(robot, point.state, motion.from_N + s * motion.change_N);
  return point;
}

std::vector<int> cables_led_by_tension(const Robot& robot, const std::vector<Pose>& poses) {
  const int n = robot.cable_count();
  const int free = n - cables_that_hold(robot);
  if (free <= 0) return {};
  std::vector<NullBasis> bases;
  for (const Pose& pose : poses) {
    const WrenchFamily family = wrench_family(robot, platform_state(robot, pose));
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
  return best;
}

}  // namespace cdprcal
