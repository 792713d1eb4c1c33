#include "cdprcal/simulator/random_start.hpp"

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

}  // namespace cdprcal
