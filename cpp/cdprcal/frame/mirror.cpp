#include "cdprcal/frame/mirror.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "cdprcal/frame/start.hpp"
#include "cdprcal/kinematics/obstruction.hpp"

namespace cdprcal::detail {
namespace {

/// Evidence from which on one image is said to be the better one [nat], as everywhere here.
constexpr double kEvidence = 3.0;
/// Sweeps of coordinate descent; the share only needs telling from one half.
constexpr int kSweeps = 100;

/// Pulleys and poses on the other side of pulley 1 along the last of the unknowns' axes.
FrameState mirrored(const FrameProblem& problem, const FrameState& state) {
  const FrameUnknowns& u = problem.unknowns;
  const int last = u.axis_count - 1;
  const Vector3 axis = u.axes.col(last);
  const Vector3& first = problem.robot.cables[0].pulley.position_m;
  FrameState out = state;
  for (int i = 0; i < u.cables; ++i) {
    const int column = u.anchor(i, last);
    if (u.held[static_cast<std::size_t>(column)]) continue;
    const Vector3& file = problem.robot.cables[static_cast<std::size_t>(i)].pulley.position_m;
    out.values[column] = -2.0 * axis.dot(file - first) - state.values[column];
  }
  for (Pose& pose : out.poses) {
    pose.position_m -= 2.0 * axis.dot(pose.position_m - first) * axis;
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
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(file * found.transpose(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double all = svd.singularValues().sum(), least = svd.singularValues().tail(1)[0];
  const auto misfit = [&](double agreement) {
    const double squares = file.squaredNorm();
    return std::max(squares - agreement * agreement / found.squaredNorm(), 1e-12 * squares);
  };
  const double d = u.axis_count;  // shift, turn and size are fitted
  const double freedom = d * u.cables - d - 0.5 * d * (d - 1.0) - 1.0;
  const double evidence = 0.5 * freedom * std::log(misfit(all - 2.0 * least) / misfit(all));
  return (svd.matrixU() * svd.matrixV().transpose()).determinant() > 0.0 ? evidence : -evidence;
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
