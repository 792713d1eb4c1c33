#include "cdprcal/frame/mirror.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/frame/gauge.hpp"
#include "cdprcal/frame/start.hpp"
#include "cdprcal/kinematics/obstruction.hpp"
#include "cdprcal/singular_values.hpp"

namespace cdprcal::detail {
namespace {

/// Sweeps of coordinate descent; the share only needs telling from one half.
constexpr int kSweeps = 100;

const Vector3& place_of(const Robot& robot, int cable) {
  return robot.cables[static_cast<std::size_t>(cable)].pulley.position_m;
}

/// With each pulley at `pulley(i)`, but for what a convention holds, and the poses at what `point`
/// makes of them.
template <class Pulley, class Point>
FrameState put(const FrameProblem& problem, const FrameState& state, Pulley pulley, Point point) {
  const FrameUnknowns& u = problem.unknowns;
  FrameState out = state;
  for (int i = 0; i < u.cables; ++i) {
    const Vector3 shift = pulley(i) - place_of(problem.robot, i);
    for (int axis = 0; axis < u.axis_count; ++axis) {
      const int column = u.anchor(i, axis);
      if (u.held[static_cast<std::size_t>(column)]) continue;
      out.values[column] = shift.dot(u.axes.col(axis));
    }
  }
  for (Pose& pose : out.poses) {
    pose.position_m = point(pose.position_m);
    pose = on_motion(problem.robot, pose);
  }
  return out;
}

/// Pulleys and poses on the other side of the first reference pulley, along the normal of the plane
/// that frames are mirrored in.
FrameState mirrored(const FrameProblem& problem, const FrameState& state) {
  const FrameUnknowns& u = problem.unknowns;
  const Vector3& normal = u.mirror_normal;
  const Vector3& first = place_of(problem.robot, u.reference[0]);
  const auto mirror = [&](const Vector3& point_m) -> Vector3 {
    return point_m - 2.0 * normal.dot(point_m - first) * normal;
  };
  const auto pulley = [&](int cable) {
    return mirror(place_of(problem.robot, cable) + u.shift(state.values, cable));
  };
  return put(problem, state, pulley, mirror);
}

/// A point in the axes of the unknowns.
Eigen::VectorXd in_axes(const FrameUnknowns& u, const Vector3& point_m) {
  return u.axes.leftCols(u.axis_count).transpose() * point_m;
}

/// The file's pulleys and others, [axes × n], moved and turned onto one another.
class BesideFile {
 public:
  explicit BesideFile(const FrameProblem& problem) : u_(problem.unknowns) {
    file_ = places(problem.robot);
    file_.colwise() -= file_.rowwise().mean().eval();
  }
  [[nodiscard]] Eigen::MatrixXd places(const Robot& robot) const {
    Eigen::MatrixXd out(u_.axis_count, u_.cables);
    for (int i = 0; i < u_.cables; ++i) out.col(i) = in_axes(u_, place_of(robot, i));
    return out;
  }
  /// How likely the file's places are of pulleys that stand so, and of their mirror image, whatever
  /// their place, turn and size: distances are of normal errors of a size that nobody knows [nat].
  struct Likely {
    double as_is, mirrored;
  };
  [[nodiscard]] Likely likely(const Eigen::MatrixXd& found) const {
    const Eigen::MatrixXd centred = found.colwise() - found.rowwise().mean();
    const Svd parts = svd(Eigen::MatrixXd(file_ * centred.transpose()));
    const bool turned = (parts.u * parts.v.transpose()).determinant() > 0.0;  // not mirrored
    const double squares = file_.squaredNorm(), size = centred.squaredNorm();
    const double d = u_.axis_count;  // shift, turn and size are fitted
    const double freedom = d * u_.cables - d - 0.5 * d * (d - 1.0) - 1.0;
    const auto of = [&](double agreement) {
      const double misfit = squares - agreement * agreement / size;
      return -0.5 * freedom * std::log(std::max(misfit, 1e-12 * squares) / squares);
    };
    const double all = parts.values.sum(), least = parts.values.tail(1)[0];
    return turned ? Likely{of(all), of(all - 2.0 * least)} : Likely{of(all - 2.0 * least), of(all)};
  }

 private:
  const FrameUnknowns& u_;
  Eigen::MatrixXd file_;
};

/// How much more the file's pulleys speak for this image than for the other [nat].
double evidence_of_file(const FrameProblem& problem, const FrameState& state) {
  const BesideFile file(problem);
  const auto [as_is, mirrored] = file.likely(file.places(moved(problem, state.values)));
  return as_is - mirrored;
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

namespace {

/// Poses of a point that lie in one plane (or line) to within the noise of a length: on which side
/// of it a pulley is its lengths do not tell.
struct OnePlane {
  Eigen::VectorXd normal, middle;  ///< in the axes of the unknowns
  std::vector<int> open;           ///< pulleys beside it that are not known to be where they are
  bool all_open = true;            ///< all that are beside it
};
std::optional<OnePlane> plane_of(const FrameProblem& problem, const FrameState& state,
                                 const Eigen::MatrixXd& pulleys, double noise_m) {
  constexpr double kSpread = 10.0;  // times the noise, by which lengths tell the sides
  const FrameUnknowns& u = problem.unknowns;
  Eigen::MatrixXd points(u.axis_count, static_cast<Eigen::Index>(state.poses.size()));
  for (std::size_t i = 0; i < state.poses.size(); ++i) {
    points.col(static_cast<Eigen::Index>(i)) = in_axes(u, state.poses[i].position_m);
  }
  OnePlane out;
  out.middle = points.rowwise().mean();
  points.colwise() -= out.middle;
  const SymmetricEigen<Eigen::MatrixXd> spread(points * points.transpose() /
                                               static_cast<double>(points.cols()));
  const double least_m = kSpread * noise_m;
  if (!(spread.eigenvalues()[0] < least_m * least_m)) return std::nullopt;
  out.normal = spread.eigenvectors().col(0);
  for (int i = 0; i < u.cables; ++i) {
    const double off_m = std::abs(out.normal.dot(pulleys.col(i) - out.middle));
    const Eigen::VectorXd own = u.precision.segment(u.anchor(i, 0), u.axis_count);
    const double sigma_m = std::sqrt(own.cwiseInverse().maxCoeff());
    if (off_m < least_m) continue;
    if (sigma_m >= 0.5 * off_m) {
      out.open.push_back(i);
    } else {
      out.all_open = false;
    }
  }
  return out;
}

/// Which of the open pulleys are to change sides: one choice of all that there are.
using Sides = std::uint32_t;
constexpr int kMostOpen = 12;

Eigen::MatrixXd changed(const OnePlane& plane, Eigen::MatrixXd pulleys, Sides sides) {
  for (std::size_t k = 0; k < plane.open.size(); ++k) {
    if ((sides >> k & 1U) == 0U) continue;
    auto at = pulleys.col(plane.open[k]);
    at -= 2.0 * plane.normal.dot(at - plane.middle) * plane.normal;
  }
  return pulleys;
}

/// The pulleys beside one plane of poses, and how likely the file's places make each choice of
/// sides: none where there are too many.
struct Choices {
  OnePlane plane;
  Eigen::MatrixXd pulleys;
  std::vector<double> likely;  ///< the first is that of the present ones
};
std::optional<Choices> choices_of(const FrameProblem& problem, const FrameState& state,
                                  double noise_m) {
  const BesideFile file(problem);
  Eigen::MatrixXd pulleys = file.places(moved(problem, state.values));
  std::optional<OnePlane> plane = plane_of(problem, state, pulleys, noise_m);
  if (!plane) return std::nullopt;
  Choices out{std::move(*plane), std::move(pulleys), {}};
  if (out.plane.open.size() > kMostOpen) return out;
  for (Sides sides = 0; sides < (Sides{1} << out.plane.open.size()); ++sides) {
    out.likely.push_back(file.likely(changed(out.plane, out.pulleys, sides)).as_is);
  }
  return out;
}

}  // namespace

std::vector<int> untold_sides(const FrameProblem& problem, const FrameState& state,
                              double noise_m) {
  const std::optional<Choices> of = choices_of(problem, state, noise_m);
  if (!of) return {};
  const auto& [plane, pulleys, likely] = *of;
  if (likely.empty()) return plane.open;
  const auto all = static_cast<Sides>(likely.size() - 1);
  Sides as_likely = 0;
  for (Sides sides = 1; sides <= all; ++sides) {
    const bool mirrors = plane.all_open && sides == all;  // of which choose_image tells
    if (!mirrors && likely[sides] > likely[0] - kEvidence) as_likely |= sides;
  }
  std::vector<int> out;
  for (std::size_t k = 0; k < plane.open.size(); ++k) {
    if ((as_likely >> k & 1U) != 0U) out.push_back(plane.open[k]);
  }
  return out;
}

void choose_sides(const FrameProblem& problem, FrameState& state, double noise_m,
                  int max_iterations) {
  const FrameUnknowns& u = problem.unknowns;
  const std::optional<Choices> of = choices_of(problem, state, noise_m);
  if (!of || of->likely.empty()) return;
  const auto best = std::ranges::max_element(of->likely);
  const double of_file = *best - of->likely[0];
  if (!(of_file > 0.0)) return;
  const auto sides = static_cast<Sides>(best - of->likely.begin());
  const Eigen::MatrixXd step = changed(of->plane, of->pulleys, sides) - of->pulleys;
  Robot other = moved(problem, state.values);
  for (int i = 0; i < u.cables; ++i) {
    other.cables[static_cast<std::size_t>(i)].pulley.position_m +=
        u.axes.leftCols(u.axis_count) * step.col(i);
  }
  // As the convention has the frame in the world.
  const int first = u.reference[0];
  const Matrix3 turn = u.axes * reference_axes(other, u.reference).transpose();
  const auto placed = [&](const Vector3& point_m) -> Vector3 {
    return turn * (point_m - place_of(other, first)) + place_of(problem.robot, first);
  };
  const auto pulley = [&](int cable) { return placed(place_of(other, cable)); };
  FrameState next = put(problem, state, pulley, placed);
  minimise(problem, next, max_iterations);
  if (next.settled && next.cost - state.cost < of_file) state = next;
}

std::optional<std::array<int, 2>> exchanged(const FrameProblem& problem, const FrameState& state) {
  const FrameUnknowns& u = problem.unknowns;
  const BesideFile file(problem);
  const Eigen::MatrixXd pulleys = file.places(moved(problem, state.values));
  const auto likely = [&](const Eigen::MatrixXd& found) {
    const auto [as_is, mirrored] = file.likely(found);
    return std::max(as_is, mirrored);
  };
  // There are as many pairs to be exchanged by chance.
  double least = likely(pulleys) + kEvidence + std::log(0.5 * u.cables * (u.cables - 1));
  std::optional<std::array<int, 2>> out;
  for (int i = 0; i < u.cables; ++i) {
    for (int j = 0; j < i; ++j) {
      Eigen::MatrixXd other = pulleys;
      other.col(i).swap(other.col(j));
      const double as_likely = likely(other);
      if (!(as_likely > least)) continue;
      least = as_likely;
      out = {j, i};
    }
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
