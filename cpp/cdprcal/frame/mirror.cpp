#include "cdprcal/frame/mirror.hpp"

#include <algorithm>
#include <cmath>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/frame/start.hpp"
#include "cdprcal/kinematics/obstruction.hpp"
#include "cdprcal/singular_values.hpp"

namespace cdprcal::detail {
namespace {

/// Sweeps of coordinate descent; the share only needs telling from one half.
constexpr int kSweeps = 100;

/// Pulleys and poses on the other side of the first reference pulley, along the normal of the plane
/// that frames are mirrored in.
FrameState mirrored(const FrameProblem& problem, const FrameState& state) {
  const FrameUnknowns& u = problem.unknowns;
  const Vector3& normal = u.mirror_normal;
  const auto place_of = [&](int cable) -> const Vector3& {
    return problem.robot.cables[static_cast<std::size_t>(cable)].pulley.position_m;
  };
  const Vector3& first = place_of(u.reference[0]);
  FrameState out = state;
  for (int i = 0; i < u.cables; ++i) {
    const Vector3 from_first = place_of(i) + u.shift(state.values, i) - first;
    const Vector3 shift = u.shift(state.values, i) - 2.0 * normal.dot(from_first) * normal;
    for (int axis = 0; axis < u.axis_count; ++axis) {
      const int column = u.anchor(i, axis);
      if (u.held[static_cast<std::size_t>(column)]) continue;
      out.values[column] = shift.dot(u.axes.col(axis));
    }
  }
  for (Pose& pose : out.poses) {
    pose.position_m -= 2.0 * normal.dot(pose.position_m - first) * normal;
    pose = on_motion(problem.robot, pose);
  }
  return out;
}

/// How much more the file's pulleys, whatever their place, turn and size, speak for this image than
/// for the other [nat]: their distances are of normal errors of a size that nobody knows.
double evidence_of_file(const FrameProblem& problem, const FrameState& state) {
  const FrameUnknowns& u = problem.unknowns;
  const Robot robot = moved(problem, state.values);
  Eigen::MatrixXd file(u.axis_count, u.cables), found = file;
  for (int i = 0; i < u.cables; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const auto axes = u.axes.leftCols(u.axis_count).transpose();
    file.col(i) = axes * problem.robot.cables[at].pulley.position_m;
    found.col(i) = axes * robot.cables[at].pulley.position_m;
  }
  file.colwise() -= file.rowwise().mean().eval();
  found.colwise() -= found.rowwise().mean().eval();
  const Svd parts = svd(Eigen::MatrixXd(file * found.transpose()));
  const double all = parts.values.sum(), least = parts.values.tail(1)[0];
  const auto misfit = [&](double agreement) {
    const double squares = file.squaredNorm();
    return std::max(squares - agreement * agreement / found.squaredNorm(), 1e-12 * squares);
  };
  const double d = u.axis_count;  // shift, turn and size are fitted
  const double freedom = d * u.cables - d - 0.5 * d * (d - 1.0) - 1.0;
  const double evidence = 0.5 * freedom * std::log(misfit(all - 2.0 * least) / misfit(all));
  return (parts.u * parts.v.transpose()).determinant() > 0.0 ? evidence : -evidence;
}

/// Poses at which cables would have to push, or something is in the way.
int impossible(const FrameProblem& problem, const FrameState& state) {
  const Robot robot = moved(problem, state.values);
  return static_cast<int>(
      std::count_if(state.poses.begin(), state.poses.end(), [&](const Pose& pose) {
        return unheld_share(robot, pose) > kUnheld ||
               !is_clear(robot, pose, platform_state(robot, pose));
      }));
}

}  // namespace

double unheld_share(const Robot& robot, const Pose& pose) {
  const bool planar = row_of(robot.platform.motion).is_planar();
  const Vector3& normal = robot.platform.motion_plane_normal;
  const auto moving = [&](const Vector3& force) -> Vector3 {
    return planar ? Vector3(force - force.dot(normal) * normal) : force;
  };
  const PlatformState state = platform_state(robot, pose);
  Vector3 left = moving(Vector3::UnitZ());
  CableVector pull = CableVector::Zero(robot.cable_count());
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    for (int i = 0; i < robot.cable_count(); ++i) {
      const Vector3 along = moving(-state.cable[static_cast<std::size_t>(i)].direction);
      const double square = along.squaredNorm();
      if (!(square > 1e-12)) continue;
      const double next = std::max(0.0, pull[i] + along.dot(left) / square);
      left -= (next - pull[i]) * along;
      pull[i] = next;
    }
  }
  return left.norm();
}

std::vector<int> untold_sides(const FrameProblem& problem, const FrameState& state,
                              double noise_m) {
  constexpr double kSpread = 10.0;  // times the noise, by which lengths tell the sides
  const FrameUnknowns& u = problem.unknowns;
  const Eigen::MatrixXd axes = u.axes.leftCols(u.axis_count);
  Eigen::MatrixXd points(u.axis_count, static_cast<Eigen::Index>(state.poses.size()));
  for (std::size_t i = 0; i < state.poses.size(); ++i) {
    points.col(static_cast<Eigen::Index>(i)) = axes.transpose() * state.poses[i].position_m;
  }
  const Eigen::VectorXd middle = points.rowwise().mean();
  points.colwise() -= middle;
  const SymmetricEigen<Eigen::MatrixXd> spread(points * points.transpose() /
                                               static_cast<double>(points.cols()));
  const double least_m = kSpread * noise_m;
  if (!(spread.eigenvalues()[0] < least_m * least_m)) return {};
  const Eigen::VectorXd normal = spread.eigenvectors().col(0);
  std::vector<int> out;
  for (int i = 0; i < u.cables; ++i) {
    const Vector3& file = problem.robot.cables[static_cast<std::size_t>(i)].pulley.position_m;
    const Eigen::VectorXd shift = axes.transpose() * u.shift(state.values, i);
    const double off_m = normal.dot(axes.transpose() * file + shift - middle);
    if (std::abs(off_m) < least_m) continue;
    const Eigen::VectorXd own = u.precision.segment(u.anchor(i, 0), u.axis_count);
    const double sigma_m = std::sqrt(own.cwiseInverse().maxCoeff());
    // Twice as far from where the file has it on the other side.
    const double other_m = (shift - 2.0 * off_m * normal).norm();
    if (sigma_m < 0.5 * std::abs(off_m) || 2.0 * shift.norm() < other_m) continue;
    out.push_back(i);
  }
  return out;
}

MirrorTold choose_image(const FrameProblem& problem, FrameState& state, int max_iterations) {
  FrameState other = mirrored(problem, state);
  settle_offsets(problem, other);
  minimise(problem, other, max_iterations);
  // > 0: for the image that there is.
  const auto decided = [&](double evidence) {
    if (evidence < 0.0) state = other;
    return std::abs(evidence) > kEvidence;
  };
  const double fits = std::isfinite(other.cost) ? other.cost - state.cost : 2.0 * kEvidence;
  if (std::abs(fits) > kEvidence) {
    decided(fits);
    return MirrorTold::by_readings;
  }
  const double file = evidence_of_file(problem, state);
  // Drawn back by what is known of pulleys: there is no other image.
  if (std::abs(file) > kEvidence && file * evidence_of_file(problem, other) > 0.0) {
    return MirrorTold::by_readings;
  }
  if (decided(file)) return MirrorTold::by_file;
  other = mirrored(problem, state);
  minimise(problem, other, max_iterations);
  const int pushed = impossible(problem, other) - impossible(problem, state);
  if (pushed < 0) state = other;
  return pushed == 0 ? MirrorTold::by_nobody : MirrorTold::by_weight;
}

}  // namespace cdprcal::detail
