#include "cdprcal/estimation/symmetric_inverse.hpp"

#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "cdprcal/decompositions.hpp"

namespace cdprcal {
namespace {

/// The plain inverse, of a matrix that is well conditioned: a tenth of the work.
std::optional<Eigen::MatrixXd> well_conditioned_inverse(const Eigen::MatrixXd& matrix) {
  constexpr double kWorst = 1e10;  // five digits are left
  const Cholesky<Eigen::MatrixXd> factor(matrix);
  if (!factor.ok()) return std::nullopt;
  const Eigen::Index size = matrix.rows();
  Eigen::MatrixXd inverse = factor.solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(size, size)));
  const auto norm = [](const Eigen::MatrixXd& of) {
    return of.cwiseAbs().colwise().sum().maxCoeff();
  };
  if (!(norm(matrix) * norm(inverse) < kWorst)) return std::nullopt;
  return Eigen::MatrixXd(0.5 * (inverse + inverse.transpose()));
}

}  // namespace

Eigen::MatrixXd symmetric_inverse(const Eigen::MatrixXd& information) {
  if (information.size() == 0 || !information.allFinite()) return information;
  const Eigen::VectorXd scale = information.diagonal().unaryExpr(
      [](double entry) { return entry > 0.0 ? 1.0 / std::sqrt(entry) : 0.0; });
  const Eigen::MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  std::vector<Eigen::Index> told;
  for (Eigen::Index k = 0; k < scale.size(); ++k) {
    if (scale[k] > 0.0) told.push_back(k);
  }
  if (const auto inverse = well_conditioned_inverse(scaled(told, told))) {
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(scale.size(), scale.size());
    out(told, told) = scale(told).asDiagonal() * *inverse * scale(told).asDiagonal();
    return out;
  }
  const SymmetricEigen<Eigen::MatrixXd> eigen(scaled);
  const double least = std::numeric_limits<double>::epsilon() *
                       static_cast<double>(information.rows()) * eigen.eigenvalues().tail(1)[0];
  const Eigen::VectorXd spread = eigen.eigenvalues().unaryExpr(
      [least](double value) { return value > least ? 1.0 / std::sqrt(value) : 0.0; });
  const Eigen::MatrixXd root = scale.asDiagonal() * eigen.eigenvectors() * spread.asDiagonal();
  return root * root.transpose();
}

}  // namespace cdprcal
