#include "cdprcal/frame/start.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/effects/moved_pulleys.hpp"
#include "cdprcal/frame/mirror.hpp"
#include "cdprcal/singular_values.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal::detail {
namespace {

/// Offsets that are tried, as shares of the shortest length: an arm that nobody counted, or a
/// belt's end that was counted twice.
constexpr std::array<double, 7> kOffsets{0.0, -0.1, 0.1, -0.3, 0.3, -0.6, 0.6};

/// Of poses, one in so many may be in a minimum of its own and bend the frame towards it.
constexpr std::array<std::size_t, 2> kDoubted{4, 2};
/// σ of angles that are to say nothing.
constexpr double kNoWeight_rad = 1e4;
/// A pose's cost that is lower by this share is of another minimum.
constexpr double kBetter = 1e-3;

/// Where settle_pose looks for a pose: the middle of the pulleys, and around it.
std::vector<Pose> places(const FrameProblem& problem, const Robot& robot) {
  Vector3 middle = middle_of_pulleys(robot);
  const Vector3 half = 0.25 * pulley_box(robot).extent_m();
  const bool hangs = !row_of(robot.platform.motion).is_planar();
  if (hangs) middle.z() -= 0.25 * robot_size_m(robot);
  std::vector<Pose> out;
  for (const Vector3& corner : {Vector3(0, 0, 0), Vector3(1, 1, 1), Vector3(1, -1, -1),
                                Vector3(-1, 1, -1), Vector3(-1, -1, 1)}) {
    Pose pose;
    pose.position_m = middle + corner.cwiseProduct(half);
    out.push_back(on_motion(problem.robot, pose));
  }
  return out;
}

/// Where a pose settles, and whether cables would have to push there, if that matters.
struct Settled {
  Pose pose;
  double cost = std::numeric_limits<double>::infinity();
  bool pushed = true;
};
/// From the best of some places by its own readings, or `best`; of minima that fit alike the first.
/// Where the state hangs, one at which cables would have to push is taken only if no other is
/// found.
Settled settled(const FrameProblem& problem, const Robot& robot, const FrameState& state,
                const FramePose& from, const std::vector<Pose>& tries, Settled best) {
  for (Pose pose : tries) {
    const double cost = settle_pose(problem, robot, state.values, from, pose);
    if (!std::isfinite(cost)) continue;
    const bool pushed = state.hangs && unheld_share(robot, pose) > kUnheld;
    const bool better = pushed == best.pushed ? cost + kBetter * (1.0 + cost) < best.cost : !pushed;
    if (better) best = {pose, cost, pushed};
  }
  return best;
}

/// Every pose to its own readings, from the level pose in the middle, around it, or the one before.
void settle_all(const FrameProblem& problem, FrameState& state) {
  const Robot robot = moved(problem, state.values);
  const std::vector<Pose> around = places(problem, robot);
  state.poses.clear();
  for (const FramePose& from : problem.poses) {
    std::vector<Pose> tries = around;
    if (!state.poses.empty()) tries.push_back(state.poses.back());
    const Settled nowhere{.pose = tries.front()};
    state.poses.push_back(settled(problem, robot, state, from, tries, nowhere).pose);
  }
}

/// Poses as lengths, roll and pitch want them, where cables pull. Swivels and yaw count from
/// anywhere: until that is known they pull poses to where the platform never was, above its
/// pulleys, too, and what they count from follows.
void hang(FrameProblem problem, FrameState& state) {
  const ChannelSigma sigma = problem.sigma;
  for (const Channel channel : {Channel::swivel, Channel::yaw}) {
    problem.sigma[static_cast<std::size_t>(channel)] = kNoWeight_rad;
  }
  state.hangs = true;
  settle_all(problem, state);
  problem.sigma = sigma;
  settle_offsets(problem, state);
}

/// Poses whose lengths are most like those of one: the platform is near, and turned alike.
std::vector<std::size_t> like(const FrameProblem& problem, std::size_t pose) {
  constexpr std::size_t kMost = 4;
  const auto lengths = [&](std::size_t i) -> const CableVector& {
    const Measurement& reading = problem.poses[i].reading;
    return reading.direct_length_m.size() > 0 ? reading.direct_length_m : reading.length_m;
  };
  std::vector<std::pair<double, std::size_t>> others;
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    // What lengths count from is another for each log.
    if (i == pose || problem.poses[i].log != problem.poses[pose].log) continue;
    if (lengths(i).size() != lengths(pose).size()) continue;
    const auto apart = (lengths(i) - lengths(pose)).array();
    const double mean = apart.isFinite().select(apart.square(), 0.0).sum() /
                        static_cast<double>(apart.isFinite().count());
    if (std::isfinite(mean)) others.emplace_back(mean, i);
  }
  const std::size_t count = std::min(kMost, others.size());
  std::partial_sort(others.begin(), others.begin() + static_cast<std::ptrdiff_t>(count),
                    others.end());
  std::vector<std::size_t> out;
  for (std::size_t k = 0; k < count; ++k) out.push_back(others[k].second);
  return out;
}

/// Turn or reflection, and shift, that take `from` to `to` best (d × n).
struct Rigid {
  Eigen::MatrixXd turn;
  Eigen::VectorXd shift;
};
Rigid best_rigid(const Eigen::MatrixXd& from, const Eigen::MatrixXd& to) {
  const Eigen::VectorXd from_mean = from.rowwise().mean(), to_mean = to.rowwise().mean();
  const Eigen::MatrixXd covariance =
      (to.colwise() - to_mean) * (from.colwise() - from_mean).transpose();
  const Svd parts = svd(covariance);
  Rigid rigid;
  rigid.turn = parts.u * parts.v.transpose();
  rigid.shift = to_mean - rigid.turn * from_mean;
  return rigid;
}

/// Turns and shifts so that the values that a convention holds are zero: the first reference pulley
/// is at its place, the second along the first axis, the third (in space) in the plane of the first
/// two.
void hold(const FrameUnknowns& u, Eigen::MatrixXd& anchors, Eigen::MatrixXd& points,
          const Eigen::MatrixXd& file) {
  if (!u.by_convention()) return;
  const Eigen::Index d = anchors.rows();
  const Eigen::VectorXd first = anchors.col(u.reference[0]), there = file.col(u.reference[0]);
  anchors.colwise() -= first;
  points.colwise() -= first;
  // Rows of `turn` are the axes: by Gram and Schmidt of the first pulleys' directions. The last one
  // makes it a turn, for the image is chosen already: by all pulleys.
  const std::vector<int> next(u.reference.begin() + 1, u.reference.begin() + 1 + d);
  const Eigen::MatrixXd of = anchors(Eigen::all, next);
  Eigen::MatrixXd q = householder_q(of);
  for (Eigen::Index i = 0; i + 1 < d; ++i) {
    if (q.col(i).dot(of.col(i)) < 0.0) q.col(i) *= -1.0;
  }
  if (q.determinant() < 0.0) q.col(d - 1) *= -1.0;
  const Eigen::MatrixXd turn = q.transpose();
  anchors = (turn * anchors).colwise() + there;
  points = (turn * points).colwise() + there;
}

/// Whole lengths of all poses, less an offset.
Eigen::MatrixXd whole_lengths(const FrameProblem& problem, double offset) {
  Eigen::MatrixXd lengths(static_cast<Eigen::Index>(problem.poses.size()), problem.unknowns.cables);
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    lengths.row(static_cast<Eigen::Index>(i)) =
        problem.poses[i].reading.direct_length_m.transpose().array() - offset;
  }
  return lengths;
}

bool all_whole(const FrameProblem& problem) {
  return std::all_of(problem.poses.begin(), problem.poses.end(), [&](const FramePose& pose) {
    const CableVector& lengths = pose.reading.direct_length_m;
    return lengths.size() == problem.unknowns.cables && lengths.allFinite();
  });
}

/// To where a tracker saw the points, where it saw enough of them.
std::optional<Rigid> tracked(const FrameProblem& problem, const Eigen::MatrixXd& axes,
                             const Eigen::MatrixXd& points) {
  Eigen::MatrixXd from(points.rows(), points.cols()), to = from;
  Eigen::Index seen = 0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Vector3& read = problem.poses[static_cast<std::size_t>(i)].reading.position_m;
    if (!read.allFinite()) continue;
    from.col(seen) = points.col(i);
    to.col(seen++) = axes.transpose() * read;
  }
  if (seen <= points.rows()) return std::nullopt;
  return best_rigid(from.leftCols(seen), to.leftCols(seen));
}

std::optional<FrameState> from_lengths(const FrameProblem& problem, double offset) {
  const FrameUnknowns& u = problem.unknowns;
  std::optional<ClosedForm> found = closed_form(whole_lengths(problem, offset), u.axis_count);
  if (!found) return std::nullopt;
  const Eigen::MatrixXd axes = u.axes.leftCols(u.axis_count);
  Eigen::MatrixXd file(u.axis_count, u.cables);
  for (int i = 0; i < u.cables; ++i) {
    file.col(i) =
        axes.transpose() * problem.robot.cables[static_cast<std::size_t>(i)].pulley.position_m;
  }
  const Rigid rigid =
      tracked(problem, axes, found->points).value_or(best_rigid(found->anchors, file));
  found->anchors = (rigid.turn * found->anchors).colwise() + rigid.shift;
  found->points = (rigid.turn * found->points).colwise() + rigid.shift;
  hold(u, found->anchors, found->points, file);
  FrameState state;
  state.values = Eigen::VectorXd::Zero(u.size);
  for (int i = 0; i < u.cables; ++i) {
    for (int axis = 0; axis < u.axis_count; ++axis) {
      state.values[u.anchor(i, axis)] = found->anchors(axis, i) - file(axis, i);
    }
  }
  for (int i = 0; i < u.direct_offset_count; ++i) state.values[u.direct_offsets + i] = offset;
  for (int i = 0; i < u.size; ++i) {
    if (u.held[static_cast<std::size_t>(i)]) state.values[i] = 0.0;
  }
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    Pose pose;
    pose.position_m = axes * found->points.col(static_cast<Eigen::Index>(i));
    state.poses.push_back(on_motion(problem.robot, pose));
  }
  return state;
}

}  // namespace

std::optional<ClosedForm> closed_form(const Eigen::MatrixXd& lengths, int dimensions) {
  const Eigen::Index m = lengths.rows(), n = lengths.cols(), d = dimensions;
  const Eigen::Index squares = d * (d + 1) / 2;
  if (n <= d || m < squares + d + 1 || !lengths.allFinite()) return std::nullopt;
  const Eigen::MatrixXd s = lengths.cwiseAbs2();
  const Eigen::VectorXd by_pose = s.rowwise().mean();
  Eigen::MatrixXd centred = s.colwise() - by_pose;
  centred.rowwise() -= centred.colwise().mean().eval();
  const Svd parts = thin_svd(centred);
  const Eigen::MatrixXd u = parts.u.leftCols(d) * parts.values.head(d).asDiagonal();
  const Eigen::MatrixXd v = parts.v.leftCols(d);
  // With p = M u + t and a about its own mean, −2 p·a = u·v: a = −½ M⁻ᵀ v. The mean over pulleys
  // is |p|² + const = uᵀC u + 2 uᵀb + const, with C = MᵀM and b = Mᵀt.
  Eigen::MatrixXd equations(m, squares + d + 1);
  for (Eigen::Index i = 0; i < m; ++i) {
    Eigen::Index column = 0;
    for (Eigen::Index j = 0; j < d; ++j) {
      for (Eigen::Index k = j; k < d; ++k) {
        equations(i, column++) = (j == k ? 1.0 : 2.0) * u(i, j) * u(i, k);
      }
    }
    equations.row(i).segment(squares, d) = 2.0 * u.row(i);
    equations(i, squares + d) = 1.0;
  }
  const auto [x, rank] = least_squares(equations, by_pose);
  if (rank < equations.cols()) return std::nullopt;
  Eigen::MatrixXd c(d, d);
  for (Eigen::Index j = 0, column = 0; j < d; ++j) {
    for (Eigen::Index k = j; k < d; ++k) c(j, k) = c(k, j) = x[column++];
  }
  // Noise may leave C without a root; its own size in place of what is missing is a start, too.
  const SymmetricEigen<Eigen::MatrixXd> eigen(c);
  if (!(eigen.eigenvalues().maxCoeff() > 0.0)) return std::nullopt;
  const Eigen::VectorXd roots =
      eigen.eigenvalues().cwiseMax(1e-3 * eigen.eigenvalues().maxCoeff()).cwiseSqrt();
  const Eigen::MatrixXd root = roots.asDiagonal() * eigen.eigenvectors().transpose();
  const Eigen::MatrixXd inverse =
      eigen.eigenvectors() * roots.cwiseInverse().asDiagonal();  // of root
  ClosedForm out;
  out.anchors = -0.5 * inverse.transpose() * v.transpose();
  const Eigen::VectorXd shift = inverse.transpose() * x.segment(squares, d);
  out.points = (root * u.transpose()).colwise() + shift;
  return out;
}

bool is_closed_form(const FrameProblem& problem) {
  return row_of(problem.robot.platform.motion).is_point() && all_whole(problem);
}

void settle_offsets(const FrameProblem& problem, FrameState& state) {
  const FrameUnknowns& u = problem.unknowns;
  const Robot robot = moved(problem, state.values);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(u.size), count = sum, sine = sum, cosine = sum;
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    const FrameRows rows =
        frame_rows(problem, robot, state.values, problem.poses[i], state.poses[i], true);
    if (!rows.valid) continue;
    for (Eigen::Index row = 0; row < rows.residual.size(); ++row) {
      const Channel channel = rows.channel[static_cast<std::size_t>(row)];
      const bool angle = channel == Channel::swivel || channel == Channel::yaw;
      for (int column = u.axis_count * u.cables; column < u.offsets_end; ++column) {
        const double slope = rows.by_common(row, column);
        if (slope == 0.0) continue;
        const double off = -rows.residual[row] / slope;
        count[column] += 1.0;
        if (angle) {  // a mean of angles on either side of ±π lies between them, not at 0
          sine[column] += std::sin(off);
          cosine[column] += std::cos(off);
        } else {
          sum[column] += off;
        }
      }
    }
  }
  for (int column = 0; column < u.size; ++column) {
    if (!(count[column] > 0.0)) continue;
    state.values[column] += sum[column] / count[column] + std::atan2(sine[column], cosine[column]);
  }
}

bool improve_poses(const FrameProblem& problem, FrameState& state) {
  if (is_closed_form(problem)) return false;
  const Robot robot = moved(problem, state.values);
  const std::vector<Pose> around = places(problem, robot);
  bool any = false;
  for (std::size_t i = 0; i < state.poses.size(); ++i) {
    const FramePose& from = problem.poses[i];
    const Pose& at = state.poses[i];
    const Settled now = settled(problem, robot, state, from, {at}, {.pose = at});
    std::vector<Pose> tries = around;
    for (const std::size_t other : like(problem, i)) tries.push_back(state.poses[other]);
    const Settled best = settled(problem, robot, state, from, tries, now);
    if (now.pushed == best.pushed && !(best.cost < now.cost)) continue;
    state.poses[i] = best.pose;
    any = true;
  }
  return any;
}

bool improve_frame(const FrameProblem& problem, FrameState& state, int max_iterations) {
  if (is_closed_form(problem)) return false;
  const Robot robot = moved(problem, state.values);
  std::vector<std::pair<double, std::size_t>> by_cost;
  for (std::size_t i = 0; i < state.poses.size(); ++i) {
    Pose pose = state.poses[i];
    by_cost.emplace_back(settle_pose(problem, robot, state.values, problem.poses[i], pose), i);
  }
  std::sort(by_cost.begin(), by_cost.end());
  for (const std::size_t doubted : kDoubted) {
    FrameProblem rest = problem;
    FrameState without{state.values, {}, kNaN, false, 0};
    const std::size_t count = by_cost.size() - by_cost.size() / doubted;
    rest.poses.clear();
    for (std::size_t k = 0; k < count; ++k) {
      rest.poses.push_back(problem.poses[by_cost[k].second]);
      without.poses.push_back(state.poses[by_cost[k].second]);
    }
    minimise(rest, without, max_iterations);
    if (!std::isfinite(without.cost)) continue;
    FrameState next = state;
    next.values = without.values;
    for (std::size_t k = 0; k < count; ++k) next.poses[by_cost[k].second] = without.poses[k];
    improve_poses(problem, next);
    minimise(problem, next, max_iterations);
    if (!(next.cost < state.cost - kBetter * (1.0 + state.cost))) continue;
    state = std::move(next);
    return true;
  }
  return false;
}

std::vector<FrameState> starts_at(const FrameProblem& problem, const std::vector<Pose>& poses) {
  FrameState state;
  state.values = Eigen::VectorXd::Zero(problem.unknowns.size);
  for (const Pose& pose : poses) state.poses.push_back(on_motion(problem.robot, pose));
  settle_offsets(problem, state);
  state.cost = frame_cost(problem, state);
  return {state};
}

FrameState drawn_start(const FrameProblem& problem, std::uint64_t draw) {
  const FrameUnknowns& u = problem.unknowns;
  RandomNormal random(draw);
  FrameState out;
  out.values = Eigen::VectorXd::Zero(u.size);
  for (int i = 0; i < u.axis_count * u.cables; ++i) {
    if (u.held[static_cast<std::size_t>(i)] || !(u.precision[i] > 0.0)) continue;
    out.values[i] = random() / std::sqrt(u.precision[i]);
  }
  hang(problem, out);
  out.cost = frame_cost(problem, out);
  return out;
}

std::vector<FrameState> starts(const FrameProblem& problem) {
  const FrameUnknowns& u = problem.unknowns;
  std::vector<FrameState> out;
  const bool closed = is_closed_form(problem);
  if (closed) {
    const double shortest = whole_lengths(problem, 0.0).minCoeff();
    for (const double share : kOffsets) {
      if (share != 0.0 && u.direct_offset_count == 0) break;
      if (auto state = from_lengths(problem, share * shortest)) out.push_back(std::move(*state));
    }
  }
  FrameState file;
  file.values = Eigen::VectorXd::Zero(u.size);
  const FrameState nothing = file;
  settle_all(problem, file);
  settle_offsets(problem, file);
  out.push_back(std::move(file));
  if (!closed) {
    FrameState hanging = nothing;
    hang(problem, hanging);
    out.push_back(std::move(hanging));
  }
  for (FrameState& state : out) state.cost = frame_cost(problem, state);
  return out;
}

}  // namespace cdprcal::detail
