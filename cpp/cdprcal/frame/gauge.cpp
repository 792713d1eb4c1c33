#include "cdprcal/frame/gauge.hpp"

#include <algorithm>
#include <numeric>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/effects/moved_pulleys.hpp"
#include "cdprcal/singular_values.hpp"

namespace cdprcal::detail {
namespace {

/// As a share of the robot's size: pulleys nearer to one another, or to a line, tell no direction.
constexpr double kTells = 0.05;

Vector3 place_of(const Robot& robot, const std::vector<int>& reference, std::size_t i) {
  if (i >= reference.size()) return Vector3::Zero();
  return robot.cables[static_cast<std::size_t>(reference[i])].pulley.position_m;
}

}  // namespace

std::vector<int> reference_pulleys(const Robot& robot, const std::vector<bool>& known) {
  std::vector<int> out(known.size());
  std::iota(out.begin(), out.end(), 0);
  std::ranges::stable_partition(out, [&](int i) { return known[static_cast<std::size_t>(i)]; });
  // The first that is nearly as far away as any comes to the front of the rest.
  const auto choose = [&](std::size_t at, auto away) {
    constexpr double kNearly = 0.3;
    if (at >= out.size()) return;
    const auto begin = out.begin() + static_cast<std::ptrdiff_t>(at);
    const double most = away(*std::ranges::max_element(begin, out.end(), {}, away));
    const auto chosen =
        std::find_if(begin, out.end(), [&](int i) { return away(i) >= kNearly * most; });
    std::rotate(begin, chosen, chosen + 1);
  };
  const auto from_first = [&](int i) -> Vector3 {
    return robot.cables[static_cast<std::size_t>(i)].pulley.position_m - place_of(robot, out, 0);
  };
  choose(1, [&](int i) { return from_first(i).norm(); });
  if (out.size() < 3) return out;
  const Vector3 along = from_first(out[1]).stableNormalized();
  choose(2, [&](int i) { return from_first(i).cross(along).norm(); });
  return out;
}

Matrix3 reference_axes(const Robot& robot, const std::vector<int>& reference) {
  const Vector3 origin = place_of(robot, reference, 0);
  const Vector3 second = place_of(robot, reference, 1) - origin;
  const Vector3 third = place_of(robot, reference, 2) - origin;
  const bool planar = row_of(robot.platform.motion).is_planar();
  Vector3 normal = planar ? robot.platform.motion_plane_normal : Vector3(second.cross(third));
  if (!(normal.norm() > 1e-9)) {
    normal = second.norm() > 1e-9 ? Vector3(second.unitOrthogonal()) : Vector3::UnitZ();
  }
  normal.normalize();
  Vector3 first = second - second.dot(normal) * normal;
  if (!(first.norm() > 1e-9)) first = normal.unitOrthogonal();
  Matrix3 axes;
  axes.col(0) = first.normalized();
  axes.col(1) = normal.cross(axes.col(0));
  axes.col(2) = normal;
  // A plane's normal may point either way: the file's third pulley is on the positive side.
  if (planar && axes.col(1).dot(third) < 0.0) axes.col(1) *= -1.0;
  return axes;
}

Eigen::MatrixXd rigid_motions(const FrameUnknowns& u, const Robot& robot) {
  const bool flat = u.axis_count == 2;
  const Vector3 middle = middle_of_pulleys(robot);
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(u.axis_count * u.cables, flat ? 3 : 6);
  for (int i = 0; i < u.cables; ++i) {
    const Vector3 arm = robot.cables[static_cast<std::size_t>(i)].pulley.position_m - middle;
    for (int axis = 0; axis < u.axis_count; ++axis) {
      const int row = u.anchor(i, axis);
      out(row, axis) = 1.0;
      for (int turn = 0; turn < (flat ? 1 : 3); ++turn) {
        const Vector3 about = u.axes.col(flat ? 2 : turn);
        out(row, u.axis_count + turn) = about.cross(arm).dot(u.axes.col(axis));
      }
    }
  }
  return out;
}

bool fixes_place(const FrameUnknowns& u, const Robot& robot) {
  const Eigen::MatrixXd rigid = rigid_motions(u, robot);
  const Eigen::VectorXd root = u.precision.head(rigid.rows()).cwiseSqrt();
  // Some σ and places are rounded numbers: what is left of a motion by them is not known.
  return range_basis(root.asDiagonal() * rigid, 1e-6).cols() == rigid.cols();
}

void hold_place(const Robot& robot, FrameUnknowns& u) {
  constexpr double kUnknown = 1e-6;  // of the best known motion; some places are rounded numbers
  Eigen::MatrixXd rigid = rigid_motions(u, robot);
  rigid.rightCols(rigid.cols() - u.axis_count) /= robot_size_m(robot);  // turns as shifts
  const Eigen::VectorXd root = u.precision.head(rigid.rows()).cwiseSqrt();
  const Svd parts = svd(Eigen::MatrixXd(root.asDiagonal() * rigid));
  const Eigen::VectorXd& known = parts.values;
  const auto rank = (known.array() > kUnknown * known[0]).count();
  // Motions that nothing fixes yet, as what they do to each coordinate.
  Eigen::MatrixXd open = rigid * parts.v.rightCols(rigid.cols() - rank);
  for (const double least : {kTells, kUnknown}) {
    for (const int cable : u.reference) {
      for (int axis = 0; axis < u.axis_count && open.cols() > 0; ++axis) {
        const int at = u.anchor(cable, axis);
        const Eigen::VectorXd moved = open.row(at).transpose();
        if (!(moved.norm() > least)) continue;
        u.held[static_cast<std::size_t>(at)] = true;
        const Eigen::MatrixXd q = householder_q(moved);
        open *= q.rightCols(open.cols() - 1).eval();
      }
    }
  }
}

}  // namespace cdprcal::detail
