#include "cdprcal/workspace/grid.hpp"

#include <algorithm>
#include <sstream>

#include "cdprcal/equilibria/wrench_distribution.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/model/robot_check.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

constexpr std::int64_t kMaxPoints = 200'000'000;

std::string text(const Vector3& v) {
  std::ostringstream out;
  out << '[' << v.x() << ", " << v.y() << ", " << v.z() << ']';
  return out.str();
}

}  // namespace

Box workspace_box(const Robot& robot) {
  if (robot.cables.empty())
    throw InputError("workspace: the robot has no cables; give one that has");
  const Box pulleys = pulley_box(robot);
  const Vector3 extent = pulleys.extent_m();
  const double side = std::max(extent.x(), extent.y());
  Box box = pulleys;
  box.lower_m.z() = pulleys.upper_m.z() - side;
  if (pulleys.lower_m.z() > 0.5 * side) box.lower_m.z() = std::max(box.lower_m.z(), 0.0);
  if (holds_orientation(robot) && extent.z() > 0.5 * side) {
    box.lower_m.z() = pulleys.lower_m.z();  // cables from below, too
  }
  const double floor_m = robot.surroundings.floor_m;
  if (floor_m < box.upper_m.z()) box.lower_m.z() = std::max(box.lower_m.z(), floor_m);
  return in_plane(robot, box);
}

Box in_plane(const Robot& robot, Box box) {
  if (const std::optional<int> across = axis_across(robot)) {
    box.lower_m[*across] = box.upper_m[*across] = 0.0;
  }
  return box;
}

std::array<int, 3> in_plane(const Robot& robot, std::array<int, 3> counts) {
  if (const std::optional<int> across = axis_across(robot)) {
    counts[static_cast<std::size_t>(*across)] = 1;
  }
  return counts;
}

void check_box(const Robot& robot, const Box& box) {
  Vector3 extent = box.upper_m - box.lower_m;
  if (const std::optional<int> across = axis_across(robot)) extent[*across] += 1.0;
  if (!box.lower_m.allFinite() || !box.upper_m.allFinite() || !(extent.minCoeff() > 0.0)) {
    throw InputError("workspace box: lower_m " + text(box.lower_m) + " must be below upper_m " +
                     text(box.upper_m) + " in every direction");
  }
  const Box pulleys = pulley_box(robot);
  const double reach = platform_reach_m(robot);
  const bool beside = box.upper_m.x() < pulleys.lower_m.x() - reach ||
                      box.lower_m.x() > pulleys.upper_m.x() + reach ||
                      box.upper_m.y() < pulleys.lower_m.y() - reach ||
                      box.lower_m.y() > pulleys.upper_m.y() + reach;
  const bool above = box.lower_m.z() > pulleys.upper_m.z() + reach;
  if (beside || above) {
    throw InputError("workspace box: " + text(box.lower_m) + " to " + text(box.upper_m) +
                     (above ? " is above" : " is beside") + " all pulleys, which span " +
                     text(pulleys.lower_m) + " to " + text(pulleys.upper_m) +
                     "; a suspended platform cannot be there: give another");
  }
}

std::array<int, 3> Grid::nearest(const Vector3& position_m) const {
  std::array<int, 3> ijk{};
  for (int a = 0; a < 3; ++a) {
    const double steps = std::round((position_m[a] - origin_m[a]) / step_m);
    ijk[a] = static_cast<int>(std::clamp(steps, 0.0, count[a] - 1.0));
  }
  return ijk;
}

double even_step_m(const Box& box, double points) {
  const Vector3 extent = box.upper_m - box.lower_m;
  const auto sides = static_cast<double>((extent.array() > 0.0).count());
  const double size = (extent.array() > 0.0).select(extent, 1.0).prod();
  return sides > 0.0 ? std::pow(size, 1.0 / sides) / std::cbrt(points) : 0.0;
}

double least_side_m(const Box& box) {
  const Vector3 extent = box.upper_m - box.lower_m;
  return (extent.array() > 0.0).select(extent, HUGE_VAL).minCoeff();
}

Grid make_grid(const Box& box, double step_m) {
  const Vector3 extent = box.upper_m - box.lower_m;
  if (!(step_m > 0.0) || !std::isfinite(step_m)) {
    throw InputError("workspace step_m: must be positive and finite [m]");
  }
  if (step_m > least_side_m(box)) {
    throw InputError("workspace step_m: " + shortest(step_m) +
                     " m is larger than the box; use a smaller step");
  }
  if ((extent / step_m).prod() > static_cast<double>(kMaxPoints)) {
    throw InputError("workspace step_m: " + shortest(step_m) +
                     " m asks for more than 200 million points; use a larger step");
  }
  Grid grid;
  grid.box = box;
  grid.step_m = step_m;
  for (int a = 0; a < 3; ++a) {
    const int steps = static_cast<int>(std::floor(extent[a] / step_m * (1.0 + 1e-12) + 1e-9));
    grid.count[a] = steps + 1;
    grid.origin_m[a] = 0.5 * (box.lower_m[a] + box.upper_m[a]) - 0.5 * steps * step_m;
  }
  return grid;
}

}  // namespace cdprcal
