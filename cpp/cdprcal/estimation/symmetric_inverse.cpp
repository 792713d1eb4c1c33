#include "cdprcal/estimation/symmetric_inverse.hpp"

#include <cmath>
#include <limits>

#include "cdprcal/decompositions.hpp"

namespace cdprcal {

Eigen::MatrixXd symmetric_inverse(const Eigen::MatrixXd& information) {
  if (information.size() == 0 || !information.allFinite()) return information;
  const Eigen::VectorXd scale = information.diagonal().unaryExpr(
      [](double entry) { return entry > 0.0 ? 1.0 / std::sqrt(entry) : 0.0; });
  const SymmetricEigen<Eigen::MatrixXd> eigen(scale.asDiagonal() * information *
                                              scale.asDiagonal());
  const double least = std::numeric_limits<double>::epsilon() *
                       static_cast<double>(information.rows()) * eigen.eigenvalues().tail(1)[0];
  const Eigen::VectorXd spread = eigen.eigenvalues().unaryExpr(
      [least](double value) { return value > least ? 1.0 / std::sqrt(value) : 0.0; });
  const Eigen::MatrixXd root = scale.asDiagonal() * eigen.eigenvectors() * spread.asDiagonal();
  return root * root.transpose();
}

}  // namespace cdprcal
