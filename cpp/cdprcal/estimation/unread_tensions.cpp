#include "cdprcal/estimation/unread_tensions.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/statics/wrench.hpp"

namespace cdprcal {

PartialBalance partial_balance(const PlatformState& state, const CableVector& tension_N,
                               const TwistBasis& guided, const Vector6& load,
                               const BalanceSigma& sigma) {
  using Columns = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMaxCables + 6>;
  const Vector6 scale = sigma.wrench.cwiseInverse();
  const WrenchMatrix structure = structure_matrix(state);
  PartialBalance out;
  out.tension_N = tension_N;
  Columns unread(6, 0), read(6, 0);
  std::vector<Eigen::Index> which;
  Vector6 wrench = -load;  // of what is read
  for (Eigen::Index c = 0; c < tension_N.size(); ++c) {
    const bool is_read = std::isfinite(tension_N[c]);
    Columns& to = is_read ? read : unread;
    to.conservativeResize(6, to.cols() + 1);
    to.rightCols<1>() = scale.cwiseProduct(structure.col(c));
    if (is_read) {
      to.rightCols<1>() *= sigma.tension_N[c];
      wrench += tension_N[c] * structure.col(c);
    } else {
      which.push_back(c);
    }
  }
  unread.conservativeResize(6, unread.cols() + guided.cols());
  unread.rightCols(guided.cols()) = scale.asDiagonal() * guided;
  const Eigen::Index silent = unread.cols(), left = 6 - silent;
  Matrix6 basis = Matrix6::Identity();
  if (silent > 0) {
    basis = householder_q(unread);
  }
  const Eigen::MatrixXd open = basis.rightCols(left);
  const Eigen::MatrixXd spread = open.transpose() * read;
  const SymmetricEigen<Eigen::MatrixXd> axes(spread * spread.transpose());
  const Eigen::VectorXd gain = axes.eigenvalues().cwiseMax(0.0);
  out.whitening.bottomRows(left) = (gain.array() + 1.0).rsqrt().matrix().asDiagonal() *
                                   axes.eigenvectors().transpose() * open.transpose() *
                                   scale.asDiagonal();
  // As many N² of variance as one N² of every tension makes, where all are alike.
  const double variance = sigma.tension_N.size() > 0 ? std::pow(sigma.tension_N.maxCoeff(), 2) : 0;
  if (variance > 0.0) out.tension_gain.tail(left) = gain / variance;

  out.tension_by_wrench.setZero(tension_N.size(), 6);
  if (which.empty()) return out;
  const Matrix6 covariance = Matrix6::Identity() + read * read.transpose();
  const Eigen::LLT<Matrix6> root(covariance);
  Eigen::MatrixXd columns = unread;
  Vector6 rest = -scale.cwiseProduct(wrench);
  root.matrixL().solveInPlace(columns);
  root.matrixL().solveInPlace(rest);
  const Eigen::MatrixXd inverse = pseudo_inverse(columns);
  Matrix6 whiten = scale.asDiagonal();
  root.matrixL().solveInPlace(whiten);
  for (std::size_t k = 0; k < which.size(); ++k) {
    const auto row = inverse.row(static_cast<Eigen::Index>(k));
    out.tension_N[which[k]] = row.dot(rest);
    out.tension_by_wrench.row(which[k]) = -row * whiten;
  }
  return out;
}

int balance_equations(const Robot& robot, const Measurement& m) {
  return m.in_balance() ? std::max(0, freedoms(robot) - m.unread_tensions()) : 0;
}

}  // namespace cdprcal
