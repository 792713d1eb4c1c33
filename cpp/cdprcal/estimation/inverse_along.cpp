#include "cdprcal/estimation/inverse_along.hpp"

#include "cdprcal/decompositions.hpp"

namespace cdprcal {

std::optional<Matrix6> inverse_along(const TwistBasis& motion, const Matrix6& information) {
  const SymmetricEigen<Eigen::MatrixXd> eigen(motion.transpose() * information * motion);
  constexpr double kSeen = 1e-12;  // of the largest
  if (!(eigen.eigenvalues().minCoeff() > kSeen * eigen.eigenvalues().maxCoeff())) {
    return std::nullopt;
  }
  const TwistBasis axes = motion * eigen.eigenvectors();
  return axes * eigen.eigenvalues().cwiseInverse().asDiagonal() * axes.transpose();
}

}  // namespace cdprcal
