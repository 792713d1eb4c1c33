#include "cdprcal/simulator/random_start.hpp"

#include "cdprcal/equilibria/wrench_distribution.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal {

std::optional<SetPoint> random_start(const Robot& robot, const Box& box, std::uint64_t seed,
                                     int tries) {
  const SetPointSolver solver(robot);
  RandomNormal random(seed);
  for (int i = 0; i < tries; ++i) {
    const Vector3 share(random.uniform(), random.uniform(), random.uniform());
    const Vector3 position_m = box.lower_m + share.cwiseProduct(Vector3(box.upper_m - box.lower_m));
    if (SetPointSolver::Result at = solver.at(position_m); at.set_point) return at.set_point;
  }
  return std::nullopt;
}

std::optional<SetPoint> parked_start(const Robot& robot, const Pose& meant, std::uint64_t seed,
                                     int tries) {
  if (!holds_orientation(robot)) {
    throw InputError("parked start: lengths do not hold the pose of " + robot.name +
                     ", it has fewer than " + std::to_string(cables_that_hold(robot)) +
                     " cables; use random_start");
  }
  RandomNormal random(seed);
  const double reach_m = kParked * robot_size_m(robot);
  for (int i = 0; i < tries; ++i) {
    Vector6 off;
    for (int axis = 0; axis < 6; ++axis) {
      off[axis] = (axis < 3 ? reach_m : kParkedTurn_rad) * (2.0 * random.uniform() - 1.0);
    }
    const Pose pose = on_motion(robot, plus(meant, off));
    const DistributedTension tension =
        distribute_wrench(robot, platform_state(robot, pose), TensionDistribution::barycentre);
    if (tension.valid && tension.polytope_exists) return SetPoint{pose, tension.tension_N};
  }
  return std::nullopt;
}

}  // namespace cdprcal
