#include "cdprcal/workspace/workspace_shape.hpp"

#include <array>
#include <cstdint>
#include <vector>

#include "cdprcal/kinematics/motion.hpp"

namespace cdprcal {
namespace {

/// How many steps (at most `limit`) a point inside is from anything that is not, in all 26
/// directions: 0 outside, 1 at the boundary.
std::vector<std::uint8_t> depth_in_steps(const Workspace& workspace, std::uint8_t limit) {
  const Grid& grid = workspace.grid;
  std::vector<std::uint8_t> depth(workspace.status.size());
  std::vector<std::uint8_t> eroded(depth.size());
  for (std::size_t k = 0; k < depth.size(); ++k) {
    depth[k] = workspace.status[k] == PointStatus::inside ? 1 : 0;
  }
  const std::array<std::int64_t, 3> stride{
      1, grid.count[0], static_cast<std::int64_t>(grid.count[0]) * grid.count[1]};
  for (std::uint8_t level = 1; level < limit; ++level) {
    // The cube of 26 neighbours as three passes along the axes.
    std::vector<std::uint8_t> current(depth.size());
    for (std::size_t k = 0; k < depth.size(); ++k) current[k] = depth[k] >= level ? 1 : 0;
    for (int axis = 0; axis < 3; ++axis) {
      for (std::int64_t k = 0; k < grid.size(); ++k) {
        const std::int64_t at = k / stride[axis] % grid.count[axis];
        const bool interior = at > 0 && at + 1 < grid.count[axis];
        eroded[k] = interior && current[k - stride[axis]] != 0 && current[k] != 0 &&
                            current[k + stride[axis]] != 0
                        ? 1
                        : 0;
      }
      current.swap(eroded);
    }
    for (std::size_t k = 0; k < depth.size(); ++k) depth[k] += current[k];
  }
  return depth;
}

/// The points of a plane shifted to both of its sides: the faces of a slab.
std::vector<Vector3> both_faces(const std::vector<Vector3>& points, const Vector3& half) {
  std::vector<Vector3> faces;
  faces.reserve(2 * points.size());
  for (const double side : {-1.0, 1.0}) {
    for (const Vector3& point : points) faces.emplace_back(point + side * half);
  }
  return faces;
}

}  // namespace

AlphaShape workspace_shape(const Workspace& workspace, const std::optional<double>& alpha_m2) {
  const double step = workspace.grid.step_m;
  AlphaShapeOptions options;
  options.alpha_m2 = alpha_m2;
  options.min_alpha_m2 = step * step;
  options.max_alpha_m2 = 4.0 * step * step;
  // A ball larger than a cell cannot pass through a full layer of grid points, so the points below
  // it do not touch the boundary at any alpha of at least a cell's.
  constexpr std::uint8_t kShell = 4;
  const bool omit = !alpha_m2 || *alpha_m2 > 0.8 * step * step;
  const std::vector<std::uint8_t> depth =
      omit ? depth_in_steps(workspace, kShell + 1) : std::vector<std::uint8_t>();
  std::vector<Vector3> points;
  for (std::size_t row = 0; row < workspace.inside.size(); ++row) {
    const std::uint8_t steps = omit ? depth[workspace.inside[row]] : 0;
    if (steps > kShell) continue;
    points.push_back(workspace.position_m(row));
    if (omit) options.core_rim.push_back(steps > 1);
  }
  points.insert(points.end(), workspace.boundary_m.begin(), workspace.boundary_m.end());
  if (const std::optional<int> across = axis_across(workspace.robot)) {
    points = both_faces(points, 0.5 * step * Vector3::Unit(*across));
  }
  if (omit) options.core_rim.resize(points.size(), false);
  return alpha_shape(points, options);
}

}  // namespace cdprcal
