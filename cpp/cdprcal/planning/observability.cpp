#include "cdprcal/planning/observability.hpp"

#include <algorithm>
#include <limits>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/estimation/assembly.hpp"
#include "cdprcal/estimation/inverse_along.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal {
namespace {

Measurement exact_measurement(const Robot& robot, const SetPoint& set_point) {
  const int n = robot.cable_count();
  const ReadingOffsets none{CableVector::Zero(n), CableVector::Zero(n), 0.0};
  RandomNormal unused(0);  // the noise is zero
  return synthetic_measurement(robot, set_point.pose, set_point.tension_N, PoseKind::static_pose,
                               none, ReadingNoise{}, unused);
}

/// A guess of ζ0 so wide (10 m, 1000 rad) that it moves no digit of a covariance that anyone would
/// use. With it the determinant compares sets of poses that leave ζ0 unobservable, too.
Eigen::MatrixXd with_wide_prior(Eigen::MatrixXd information) {
  information.diagonal().head<3>().array() += 1e-2;
  information.diagonal().segment<3>(3).array() += 1e-6;
  return information;
}

/// log det of the information on ζ0 (the Schur complement): log det of the whole matrix minus that
/// of the block of the reference errors.
double log_determinant(const Eigen::MatrixXd& information) {
  const auto of = [](const Eigen::MatrixXd& m) {
    if (m.rows() == 0) return 0.0;
    const Cholesky<Eigen::MatrixXd> factor(m);
    return factor.ok() ? factor.log_determinant() : -std::numeric_limits<double>::infinity();
  };
  const Eigen::Index errors = information.rows() - 6;
  return of(information) - of(information.bottomRightCorner(errors, errors));
}

}  // namespace

CalibrationProblem predicted_problem(const Robot& robot, const SetPoint& start,
                                     const std::vector<SetPoint>& set_points) {
  CalibrationProblem problem;
  problem.robot = robot;
  problem.measurements.push_back(exact_measurement(robot, start));
  for (const SetPoint& s : set_points) problem.measurements.push_back(exact_measurement(robot, s));
  return problem;
}

std::optional<Matrix6> predicted_covariance(const Robot& robot, const SetPoint& start,
                                            const std::vector<SetPoint>& set_points) {
  const CalibrationProblem problem = predicted_problem(robot, start, set_points);
  std::vector<Pose> poses{start.pose};
  for (const SetPoint& s : set_points) poses.push_back(s.pose);
  Assembly assembly(problem, poses);
  assembly.poses().update_wrench_weights(1.0);
  return assembly.reference_information().covariance;
}

Observability::Observability(const Robot& robot, const SetPoint& start)
    : robot_(robot), start_(start) {
  start_information_ = linearised(start).start;
}

Observability::Split Observability::linearised(const SetPoint& set_point) const {
  const CalibrationProblem problem = predicted_problem(robot_, start_, {set_point});
  Assembly assembly(problem, {start_.pose, set_point.pose});
  assembly.poses().update_wrench_weights(1.0);
  Eigen::VectorXd residuals;
  Eigen::MatrixXd jacobian;  // columns: ζ0, ζ1, reference errors
  assembly.linearise(residuals, jacobian);
  const Eigen::Index common = jacobian.cols() - 6;
  Split split{Eigen::MatrixXd::Zero(common, common), Eigen::MatrixXd::Zero(common, common)};
  Matrix6 own = Matrix6::Zero();
  Eigen::MatrixXd cross = Eigen::MatrixXd::Zero(6, common);
  for (Eigen::Index row = 0; row < jacobian.rows(); ++row) {
    const Vector6 by_own = jacobian.row(row).segment<6>(6).transpose();
    Eigen::VectorXd by_common(common);
    by_common << jacobian.row(row).head<6>().transpose(),
        jacobian.row(row).tail(common - 6).transpose();
    if (by_own.isZero(0.0)) {
      split.start += by_common * by_common.transpose();
    } else {
      split.added += by_common * by_common.transpose();
      own += by_own * by_own.transpose();
      cross += by_own * by_common.transpose();
    }
  }
  split.added -= cross.transpose() * least_norm(Eigen::MatrixXd(own), Eigen::MatrixXd(cross));
  split.added = 0.5 * (split.added + split.added.transpose()).eval();
  return split;
}

Eigen::MatrixXd Observability::added_by(const SetPoint& set_point) const {
  return linearised(set_point).added;
}

Matrix6 Observability::on_initial_pose(const Eigen::MatrixXd& information) {
  const Eigen::Index errors = information.rows() - 6;
  Matrix6 out = information.topLeftCorner<6, 6>();
  if (errors > 0) {
    const Eigen::MatrixXd coupling = information.bottomLeftCorner(errors, 6);
    out -= coupling.transpose() *
           least_norm(information.bottomRightCorner(errors, errors).eval(), coupling);
  }
  return 0.5 * (out + out.transpose());
}

Selection select_d_optimal(const Eigen::MatrixXd& start_information,
                           const std::vector<Eigen::MatrixXd>& information, int count,
                           const std::function<bool()>& proceed, const TwistBasis& motion) {
  const int candidates = static_cast<int>(information.size());
  if (count < 1 || count > candidates) {
    throw InputError("observability: " + std::to_string(count) + " poses cannot be chosen from " +
                     std::to_string(candidates) + " candidates; give between 1 and their number");
  }
  Selection selection;
  std::vector<bool> taken(information.size(), false);
  Eigen::MatrixXd sum = with_wide_prior(start_information);
  const auto finish = [&](bool stopped) {
    selection.stopped = stopped;
    Eigen::MatrixXd total = start_information;
    for (const int c : selection.chosen) total += information[c];
    selection.covariance = inverse_along(motion, Observability::on_initial_pose(total));
    return selection;
  };
  /// The free candidate that adds most to `sum`, and what the determinant becomes.
  const auto best_addition = [&] {
    std::pair<int, double> best{-1, -std::numeric_limits<double>::infinity()};
    for (int c = 0; c < candidates; ++c) {
      if (taken[c]) continue;
      const double value = log_determinant(sum + information[c]);
      if (best.first < 0 || value > best.second) best = {c, value};
    }
    return best;
  };
  while (static_cast<int>(selection.chosen.size()) < count) {
    if (proceed && !proceed()) return finish(true);
    const int c = best_addition().first;
    taken[c] = true;
    sum += information[c];
    selection.chosen.push_back(c);
  }
  // Fedorov's exchange: take one out, put the best one in.
  constexpr double kGain = 1e-9;
  for (bool improved = true; improved;) {
    improved = false;
    for (int& chosen : selection.chosen) {
      if (proceed && !proceed()) return finish(true);
      const double now = log_determinant(sum);
      sum -= information[chosen];
      taken[chosen] = false;
      const auto [c, value] = best_addition();
      if (value > now + kGain) {
        chosen = c;
        improved = true;
      }
      taken[chosen] = true;
      sum += information[chosen];
    }
  }
  return finish(false);
}

}  // namespace cdprcal
