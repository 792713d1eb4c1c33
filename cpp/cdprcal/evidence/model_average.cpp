#include "cdprcal/evidence/model_average.hpp"

#include <algorithm>
#include <cmath>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/estimation/symmetric_inverse.hpp"
#include "cdprcal/evidence/checks.hpp"
#include "cdprcal/evidence/steps.hpp"
#include "cdprcal/geometry/pose.hpp"
#include "cdprcal/statistics.hpp"

namespace cdprcal {
namespace {

/// The probability that goes with log odds.
double probability(double log_odds) { return 1.0 / (1.0 + std::exp(-log_odds)); }

/// What σ along an axis is multiplied by so that it bounds what possibilities do there.
double widening_along(int axis, const Matrix6& own, const Matrix6& averaged,
                      const std::vector<Possibility>& others) {
  constexpr double kBound = 4.0;     // σ: what is taken for certain
  constexpr double kBeyond = 0.001;  // a fifth of one pose in two hundred: errors have the rest
  constexpr double kPrecise = 1.01;
  const auto beyond = [&](double widening) {
    const double bound = kBound * widening * std::sqrt(averaged(axis, axis));
    double sum = 0.0;
    for (const Possibility& p : others) {
      const double sigma = std::sqrt(own(axis, axis) + p.spread(axis, axis));
      sum += p.probability * (normal_survival((bound - p.shift[axis]) / sigma) +
                              normal_survival((bound + p.shift[axis]) / sigma));
    }
    return sum;
  };
  double low = 1.0, high = 1.0;
  while (beyond(high) > kBeyond) high *= 2.0;  // never where it is not a number
  while (high > kPrecise * low) {
    const double middle = std::sqrt(low * high);
    (beyond(middle) > kBeyond ? low : high) = middle;
  }
  return high;
}

}  // namespace

Unseen unseen_effects(const DiagnosisModel& model, std::vector<CandidateScore> scores) {
  const auto known = static_cast<double>(model.effects.size() + scores.size());
  for (CandidateScore& step : first_step_scores(model)) scores.push_back(std::move(step));
  Candidates candidates;
  for (const CandidateScore& score : scores) candidates.push_back(score.effect);
  const DiagnosisSystem system = linearise(model, candidates);
  Unseen out;
  if (!system.valid || system.poses.empty()) {
    out.possible = Matrix6::Constant(kNaN);
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
      -system.pose_by_rows(first) * system.by_common.middleRows(first.begin, first.size);
  // All but the candidates settle anew for each of them.
  const Eigen::MatrixXd response =
      symmetric_inverse(information.topLeftCorner(nuisance, nuisance)) *
      information.topRightCorner(nuisance, static_cast<Eigen::Index>(system.layout.candidates));
  const Eigen::Index values = model.values().size();
  out.of_values.setZero(values);
  const auto found = static_cast<double>(model.effects.size());
  const double prior_log_odds = std::log((found + 1.0) / (known - found + 1.0));
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const Eigen::Index begin = system.layout.candidate_begin[k];
    const Eigen::Index size = system.layout.candidate_size[k];
    const auto of = response.middleCols(begin - nuisance, size);
    Eigen::MatrixXd own = information.block(begin, begin, size, size) -
                          information.block(begin, 0, size, nuisance) * of;
    own.diagonal().array() += 1.0;  // the prior: candidates count in typical sizes
    const Cholesky<Eigen::MatrixXd> factor(own);
    const Eigen::MatrixXd moved =
        follows.middleCols(begin, size) - follows.leftCols(nuisance) * of;  // 6 × size
    const Eigen::VectorXd slope =
        gradient.segment(begin, size) - of.transpose() * gradient.head(nuisance);
    const Eigen::VectorXd value = -factor.solve(slope);
    const Vector6 shift = moved * value;
    const Matrix6 spread = moved * factor.solve(Eigen::MatrixXd(moved.transpose()));
    const double there = candidates[k]->is_stated(model.robot)
                             ? 1.0
                             : probability(prior_log_odds + scores[k].log_evidence);
    out.each.push_back({there, shift, spread});
    const Eigen::MatrixXd by_value = of.bottomRows(values);
    const Eigen::VectorXd of_spread =
        (by_value * factor.solve(Eigen::MatrixXd(by_value.transpose()))).diagonal();
    out.of_values += there * ((by_value * value).cwiseAbs2() + of_spread);
    if (!candidates[k]->info().all_or_nothing && !as_step(*candidates[k])) out.possible += spread;
  }
  return out;
}

InitialPose initial_pose_of(const DiagnosisModel& model) {
  return {model.runs.front().poses.front(),
          initial_pose_covariance(with_uncertain_noise(model), 0)};
}

Possibility in_place_of(const InitialPose& present, const InitialPose& other, double probability) {
  // Along some directions the other may know more: that is no reason to claim more. In units of the
  // present one's σ, so that metres and radians are alike; guides leave some directions none.
  constexpr double kNone = 1e-12;  // of a correlation
  const auto inverse = [](double v) { return v > 0.0 ? 1.0 / v : 0.0; };
  const Vector6 sigma = present.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Matrix6 of_units = sigma.unaryExpr(inverse).asDiagonal();
  const SymmetricEigen<Matrix6> own(of_units * present.covariance * of_units);
  const Vector6 spread =
      own.eigenvalues().unaryExpr([](double v) { return v > kNone ? std::sqrt(v) : 0.0; });
  const Matrix6 root = sigma.asDiagonal() * own.eigenvectors() * spread.asDiagonal();
  const Matrix6 whiten =
      spread.unaryExpr(inverse).asDiagonal() * own.eigenvectors().transpose() * of_units;
  const SymmetricEigen<Matrix6> less_known(whiten * other.covariance * whiten.transpose() -
                                           Matrix6::Identity());
  const Matrix6 axes = root * less_known.eigenvectors();
  return {probability, minus(other.pose, present.pose),
          axes * less_known.eigenvalues().cwiseMax(0.0).asDiagonal() * axes.transpose()};
}

std::vector<Possibility> possibilities(const InitialPose& present,
                                       const std::vector<Alternative>& others) {
  double most = 0.0;  // the present one's
  for (const Alternative& other : others) most = std::max(most, other.log_evidence);
  double total = std::exp(-most);
  for (const Alternative& other : others) total += std::exp(other.log_evidence - most);
  std::vector<Possibility> out;
  for (const Alternative& other : others) {
    out.push_back(in_place_of(present, other.initial, std::exp(other.log_evidence - most) / total));
  }
  return out;
}

Matrix6 averaged_covariance(const Matrix6& own, const std::vector<Possibility>& others) {
  Matrix6 out = own;
  for (const Possibility& p : others) {
    out += p.probability * (p.shift * p.shift.transpose() + p.spread);
  }
  Vector6 widening;
  for (int axis = 0; axis < 6; ++axis) widening[axis] = widening_along(axis, own, out, others);
  return widening.asDiagonal() * out * widening.asDiagonal();
}

Matrix6 averaged_covariance(const Matrix6& own, const Unseen& unseen, bool enough,
                            std::vector<Possibility> others) {
  if (!enough) return averaged_covariance(own + unseen.possible, others);
  others.insert(others.end(), unseen.each.begin(), unseen.each.end());
  return averaged_covariance(own, others);
}

}  // namespace cdprcal
