#include "cdprcal/kinematics/obstruction.hpp"

#include <algorithm>

#include "cdprcal/text.hpp"

namespace cdprcal {
namespace {

enum class Against { nothing, floor, box, cable_in_box, length };

struct Found {
  Against against = Against::nothing;
  std::size_t box = 0;
  int cable = 0;
  double at_m = 0.0;
};

Box around_platform(const Robot& robot, const Pose& pose, const PlatformState& state) {
  Box out{pose.position_m, pose.position_m};
  const auto take = [&](const Vector3& arm_m) { out.include(pose.position_m + arm_m); };
  for (int i = 0; i < state.cable_count; ++i) take(state.anchor_arm_m[i]);
  for (const Vector3& corner : robot.platform.outline_m) take(state.rotation * corner);
  return out;
}

bool overlap(const Box& a, const Box& b) {
  return (a.lower_m.array() < b.upper_m.array()).all() &&
         (b.lower_m.array() < a.upper_m.array()).all();
}

/// Whether a segment passes through a box: the parts of it between the faces of each axis overlap.
bool passes(const Vector3& from, const Vector3& to, const Box& box) {
  double enter = 0.0, leave = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double way = to[axis] - from[axis];
    double low = box.lower_m[axis] - from[axis], high = box.upper_m[axis] - from[axis];
    if (way == 0.0) {
      if (low >= 0.0 || high <= 0.0) return false;
      continue;
    }
    low /= way;
    high /= way;
    enter = std::max(enter, std::min(low, high));
    leave = std::min(leave, std::max(low, high));
  }
  return enter < leave;
}

Found first_found(const Robot& robot, const Pose& pose, const PlatformState& state) {
  const Surroundings& around = robot.surroundings;
  if (!around.any()) return {};
  const Box platform = around_platform(robot, pose, state);
  if (platform.lower_m.z() < around.floor_m) {
    return {Against::floor, 0, 0, platform.lower_m.z()};
  }
  for (std::size_t b = 0; b < around.keep_out.size(); ++b) {
    if (overlap(platform, around.keep_out[b])) return {Against::box, b, 0, 0.0};
  }
  for (int i = 0; i < state.cable_count; ++i) {
    const CableState& cable = state.cable[i];
    const double length_m = cable.length_m;
    if (around.limits_length() &&
        !(length_m >= around.length_min_m && length_m <= around.length_max_m)) {
      return {Against::length, 0, i, length_m};
    }
    if (cable.status != CableStatus::ok) continue;
    const Vector3 anchor = pose.position_m + state.anchor_arm_m[i];
    const Vector3 leaves = anchor - cable.free_length_m * cable.direction;
    for (std::size_t b = 0; b < around.keep_out.size(); ++b) {
      if (passes(leaves, anchor, around.keep_out[b])) return {Against::cable_in_box, b, i, 0.0};
    }
  }
  return {};
}

}  // namespace

bool is_clear(const Robot& robot, const Pose& pose, const PlatformState& state) {
  return first_found(robot, pose, state).against == Against::nothing;
}

std::string obstruction(const Robot& robot, const Pose& pose, const PlatformState& state) {
  const Found found = first_found(robot, pose, state);
  const Surroundings& around = robot.surroundings;
  const std::size_t box = found.box + 1;
  switch (found.against) {
    case Against::nothing:
      break;
    case Against::floor:
      return printed("the platform reaches down to z = %.3f m, below floor_m %.3f", found.at_m,
                     around.floor_m);
    case Against::box:
      return printed("the platform is in keep_out[#%zu]", box);
    case Against::cable_in_box:
      return printed("cable %d passes through keep_out[#%zu]", found.cable + 1, box);
    case Against::length:
      return printed("cable %d is %.3f m long, length_limits_m is [%.3g, %.3g]", found.cable + 1,
                     found.at_m, around.length_min_m, around.length_max_m);
  }
  return "";
}

}  // namespace cdprcal
