// A regular grid of platform positions in a box.
#pragma once

#include <array>
#include <cstdint>

#include "cdprcal/geometry/box.hpp"
#include "cdprcal/model/robot.hpp"

namespace cdprcal {

/// Where a suspended platform's reference point P may be: the horizontal rectangle of the pulleys;
/// from the highest pulley down by the larger side of that rectangle, but not below the floor z = 0
/// when the lowest pulley hangs above it by over half that side; down to the lowest pulley where
/// those of cables that hold the orientation are that far above one another; never below the
/// robot's floor_m. Of a planar platform: flat, in its plane.
Box workspace_box(const Robot& robot);

/// A box's part in the plane of a planar platform; the box itself of any other.
Box in_plane(const Robot& robot, Box box);
/// Counts of a grid along x, y, z: one across the plane of a planar platform.
std::array<int, 3> in_plane(const Robot& robot, std::array<int, 3> counts);

/// Throws InputError when the box is empty (but flat across a planar platform's plane) or not
/// finite, or lies wholly where no cable can hold the platform up: beside all pulleys or above them
/// (by more than the platform's own size).
void check_box(const Robot& robot, const Box& box);

/// Points at equal steps in all directions, centred in the box.
struct Grid {
  Box box;
  Vector3 origin_m = Vector3::Zero();  ///< the point of index (0, 0, 0)
  double step_m = 0.0;
  std::array<int, 3> count{0, 0, 0};

  [[nodiscard]] std::int64_t size() const {
    return static_cast<std::int64_t>(count[0]) * count[1] * count[2];
  }
  [[nodiscard]] std::int64_t index(const std::array<int, 3>& ijk) const {
    return (static_cast<std::int64_t>(ijk[2]) * count[1] + ijk[1]) * count[0] + ijk[0];
  }
  [[nodiscard]] std::array<int, 3> coordinates(std::int64_t index) const {
    return {static_cast<int>(index % count[0]), static_cast<int>(index / count[0] % count[1]),
            static_cast<int>(index / count[0] / count[1])};
  }
  [[nodiscard]] Vector3 position_m(const std::array<int, 3>& ijk) const {
    return origin_m + step_m * Vector3(ijk[0], ijk[1], ijk[2]);
  }
  /// Coordinates of the closest grid point.
  [[nodiscard]] std::array<int, 3> nearest(const Vector3& position_m) const;
};

/// The step of a grid of about so many points in a box: of as many along each side in a flat one.
double even_step_m(const Box& box, double points);
/// The shortest side that is not flat [m].
double least_side_m(const Box& box);

/// One layer across a flat box. Throws InputError when the step is not positive and finite, exceeds
/// the box, or asks for more than 2·10⁸ points.
Grid make_grid(const Box& box, double step_m);

}  // namespace cdprcal
