#include "cdprcal/evidence/model_average.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "cdprcal/geometry/pose.hpp"

namespace cdprcal {
namespace {

/// The probability that goes with log odds.
double probability(double log_odds) { return 1.0 / (1.0 + std::exp(-log_odds)); }

}  // namespace

Unseen covariance_of_unseen(const DiagnosisModel& model,
                            const std::vector<CandidateScore>& scores) {
  Candidates candidates;
  for (const CandidateScore& score : scores) candidates.push_back(score.effect);
  const DiagnosisSystem system = linearise(model, candidates);
  Unseen out;
  if (!system.valid || system.poses.empty()) {
    out.probable = out.possible = Matrix6::Constant(kNaN);
    return out;
  }
  const Eigen::Index nuisance = system.layout.nuisance();
  const auto columns = system.free_by_common;
  Eigen::MatrixXd information = columns.transpose() * columns;
  Eigen::VectorXd gradient = columns.transpose() * system.free_residual;
  information.topLeftCorner(nuisance, nuisance).diagonal() += system.prior_precision.head(nuisance);
  gradient.head(nuisance) += system.prior_precision.head(nuisance).cwiseSqrt().cwiseProduct(
      system.prior_residual.head(nuisance));
  // The first pose follows the common unknowns: δζ = −A⁺ C δx.
  const DiagnosisSystem::PoseRange& first = system.poses.front();
  const Eigen::MatrixXd follows =
      -Eigen::MatrixXd(system.by_pose.middleRows(first.begin, first.size))
           .completeOrthogonalDecomposition()
           .pseudoInverse() *
      system.by_common.middleRows(first.begin, first.size);
  // All but the candidates settle anew for each of them.
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> settled(
      information.topLeftCorner(nuisance, nuisance));
  const Eigen::MatrixXd response = settled.solve(
      information.topRightCorner(nuisance, static_cast<Eigen::Index>(system.layout.candidates)));
  const auto found = static_cast<double>(model.effects.size());
  const auto known = static_cast<double>(model.effects.size() + candidates.size());
  const double prior_log_odds = std::log((found + 1.0) / (known - found + 1.0));
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const Eigen::Index begin = system.layout.candidate_begin[k];
    const Eigen::Index size = system.layout.candidate_size[k];
    const auto of = response.middleCols(begin - nuisance, size);
    Eigen::MatrixXd own = information.block(begin, begin, size, size) -
                          information.block(begin, 0, size, nuisance) * of;
    own.diagonal().array() += 1.0;  // the prior: candidates count in typical sizes
    const Eigen::LLT<Eigen::MatrixXd> llt(own);
    const Eigen::MatrixXd moved =
        follows.middleCols(begin, size) - follows.leftCols(nuisance) * of;  // 6 × size
    const Eigen::VectorXd value =
        -llt.solve(gradient.segment(begin, size) - of.transpose() * gradient.head(nuisance));
    const Vector6 shift = moved * value;
    const Matrix6 spread = moved * llt.solve(moved.transpose());
    out.probable +=
        probability(prior_log_odds + scores[k].log_evidence) * (shift * shift.transpose() + spread);
    if (!candidates[k]->info().of_robot_file) out.possible += spread;
  }
  return out;
}

Matrix6 covariance_of_alternatives(const Pose& present, const std::vector<Alternative>& others) {
  double most = 0.0;  // the present one's
  for (const Alternative& other : others) most = std::max(most, other.log_evidence);
  double total = std::exp(-most);
  for (const Alternative& other : others) total += std::exp(other.log_evidence - most);
  Matrix6 out = Matrix6::Zero();
  for (const Alternative& other : others) {
    const Vector6 away = minus(other.pose, present);
    out += std::exp(other.log_evidence - most) / total * away * away.transpose();
  }
  return out;
}

}  // namespace cdprcal
