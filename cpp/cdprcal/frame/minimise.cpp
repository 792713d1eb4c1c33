#include "cdprcal/frame/minimise.hpp"

#include "cdprcal/decompositions.hpp"

namespace cdprcal::detail {
namespace {

/// A step that lowers the cost by less than this share of it changes nothing that can be seen.
constexpr double kSettled = 1e-10;
constexpr double kLeastDamping = 1e-12;
constexpr double kMostDamping = 1e12;
/// Of a column's own square: below it a pose's direction counts as not seen.
constexpr double kRankTolerance = 1e-7;

using PoseVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 6, 1>;

/// The normal equations of one pose.
struct Normal {
  SmallSquare pose;
  Eigen::MatrixXd cross;  ///< pose × common
  PoseVector gradient;
};

double prior_cost(const FrameProblem& problem, const Eigen::VectorXd& values) {
  return 0.5 * problem.unknowns.precision.dot(values.cwiseAbs2());
}

Pose stepped(const FrameProblem& problem, const Pose& pose, const Eigen::VectorXd& step) {
  return on_motion(problem.robot, plus(pose, problem.basis * step));
}

/// One linearisation: everything a step needs at any damping.
struct Linear {
  bool valid = true;
  Eigen::MatrixXd common;
  Eigen::VectorXd gradient;
  std::vector<Normal> poses;
};

Linear linearised(const FrameProblem& problem, const FrameState& state) {
  const FrameUnknowns& u = problem.unknowns;
  Linear out;
  out.common = u.precision.asDiagonal();
  out.gradient = u.precision.cwiseProduct(state.values);
  const Robot robot = moved(problem, state.values);
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    const FrameRows rows =
        frame_rows(problem, robot, state.values, problem.poses[i], state.poses[i], true);
    out.valid = out.valid && rows.valid;
    if (!rows.valid) return out;
    out.common.noalias() += rows.by_common.transpose() * rows.by_common;
    out.gradient.noalias() += rows.by_common.transpose() * rows.residual;
    out.poses.push_back({rows.by_pose.transpose() * rows.by_pose,
                         rows.by_pose.transpose() * rows.by_common,
                         rows.by_pose.transpose() * rows.residual});
  }
  return out;
}

template <class Matrix>
void damp(Matrix& matrix, double damping) {
  const double least = 1e-12 * (1.0 + matrix.diagonal().maxCoeff());
  matrix.diagonal() += damping * matrix.diagonal() + decltype(matrix.diagonal().eval())::Constant(
                                                         matrix.rows(), damping * least + least);
}

/// The step of a linearisation at a damping, applied.
FrameState step(const FrameProblem& problem, const FrameState& from, const Linear& linear,
                double damping) {
  const FrameUnknowns& u = problem.unknowns;
  Eigen::MatrixXd schur = linear.common;
  damp(schur, damping);
  Eigen::VectorXd right = -linear.gradient;
  std::vector<Eigen::MatrixXd> solved;
  solved.reserve(linear.poses.size());
  for (const Normal& normal : linear.poses) {
    SmallSquare own = normal.pose;
    damp(own, damping);
    const Cholesky<SmallSquare> factor(own);
    Eigen::MatrixXd both(own.rows(), u.size + 1);
    both << normal.cross, normal.gradient;
    solved.push_back(factor.solve(both));
    schur.noalias() -= normal.cross.transpose() * solved.back().leftCols(u.size);
    right.noalias() += normal.cross.transpose() * solved.back().col(u.size);
  }
  for (int i = 0; i < u.size; ++i) {
    if (!u.held[static_cast<std::size_t>(i)]) continue;
    schur.row(i).setZero();
    schur.col(i).setZero();
    schur(i, i) = 1.0;
    right[i] = 0.0;
  }
  const Eigen::VectorXd change = solve_symmetric(schur, right);
  FrameState to = from;
  to.values += change;
  for (std::size_t i = 0; i < to.poses.size(); ++i) {
    to.poses[i] = stepped(problem, from.poses[i],
                          -solved[i].col(u.size) - solved[i].leftCols(u.size) * change);
  }
  return to;
}

}  // namespace

double frame_cost(const FrameProblem& problem, const FrameState& state) {
  if (!state.values.allFinite()) return kNaN;
  double cost = prior_cost(problem, state.values);
  const Robot robot = moved(problem, state.values);
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    const FrameRows rows =
        frame_rows(problem, robot, state.values, problem.poses[i], state.poses[i], false);
    if (!rows.valid) return kNaN;
    cost += 0.5 * rows.residual.squaredNorm();
  }
  return cost;
}

void minimise(const FrameProblem& problem, FrameState& state, int max_iterations) {
  state.cost = frame_cost(problem, state);
  state.settled = false;
  double damping = 1e-4;
  for (int i = 0; i < max_iterations && std::isfinite(state.cost); ++i) {
    const Linear linear = linearised(problem, state);
    if (!linear.valid) return;
    ++state.iterations;
    for (bool better = false; !better;) {
      FrameState next = step(problem, state, linear, damping);
      next.cost = frame_cost(problem, next);
      better = next.cost <= state.cost;  // false for NaN
      if (better) {
        state.settled = state.cost - next.cost <= kSettled * (1.0 + state.cost);
        const int iterations = state.iterations;
        const bool settled = state.settled;
        state = std::move(next);
        state.iterations = iterations;
        state.settled = settled;
        damping = std::max(0.1 * damping, kLeastDamping);
      } else {
        damping *= 10.0;
        if (damping > kMostDamping) {  // no step helps: rounding is all that is left
          state.settled = true;
          return;
        }
      }
    }
    if (state.settled) return;
  }
}

FrameInformation information(const FrameProblem& problem, const FrameState& state) {
  const FrameUnknowns& u = problem.unknowns;
  const auto count = static_cast<Eigen::Index>(problem.poses.size());
  FrameInformation out;
  out.normal = Eigen::MatrixXd::Zero(u.size, u.size);
  out.scores = Eigen::MatrixXd::Zero(u.size, count);
  out.misfit = Eigen::VectorXd::Zero(count);
  out.freedom = Eigen::VectorXi::Zero(count);
  const Robot robot = moved(problem, state.values);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    out.rows.push_back(
        frame_rows(problem, robot, state.values, problem.poses[at], state.poses[at], true));
    const FrameRows& rows = out.rows.back();
    if (!rows.valid) return out;
    const Eigen::MatrixXd free = basis_across(rows.by_pose, kRankTolerance);
    out.freedom[i] = static_cast<int>(free.cols());
    const Eigen::MatrixXd common = free.transpose() * rows.by_common;
    const Eigen::VectorXd residual = free.transpose() * rows.residual;
    out.normal.noalias() += common.transpose() * common;
    out.scores.col(i) = common.transpose() * residual;
    out.misfit[i] = residual.squaredNorm();
  }
  out.valid = true;
  return out;
}

double settle_pose(const FrameProblem& problem, const Robot& robot, const Eigen::VectorXd& values,
                   const FramePose& from, Pose& pose, int max_iterations) {
  FrameRows rows = frame_rows(problem, robot, values, from, pose, true);
  if (!rows.valid) return kNaN;
  double cost = 0.5 * rows.residual.squaredNorm();
  double damping = 1e-3;
  for (int i = 0; i < max_iterations && damping < kMostDamping; ++i) {
    SmallSquare own = rows.by_pose.transpose() * rows.by_pose;
    damp(own, damping);
    const Eigen::VectorXd gradient = rows.by_pose.transpose() * rows.residual;
    const Eigen::VectorXd step = -Cholesky<SmallSquare>(own).solve(gradient);
    const Pose next = stepped(problem, pose, step);
    FrameRows there = frame_rows(problem, robot, values, from, next, true);
    const double lower = there.valid ? 0.5 * there.residual.squaredNorm() : kNaN;
    if (lower <= cost) {
      const bool settled = cost - lower <= kSettled * (1.0 + cost);
      pose = next;
      cost = lower;
      rows = std::move(there);
      damping = std::max(0.1 * damping, kLeastDamping);
      if (settled) return cost;
    } else {
      damping *= 10.0;
    }
  }
  return cost;
}

}  // namespace cdprcal::detail
