// Singular values of a matrix: Eigen's, compiled once, as other decompositions.
#pragma once

#include "cdprcal/types.hpp"

namespace cdprcal {

/// A = U diag(values) Vᵀ, values descending.
struct Svd {
  Eigen::MatrixXd u;
  Eigen::VectorXd values;
  Eigen::MatrixXd v;
  Eigen::Index rank = 0;  ///< values beyond rounding
};
Svd svd(const Eigen::MatrixXd& a);
/// Without the columns of U and V that no value has.
Svd thin_svd(const Eigen::MatrixXd& a);

}  // namespace cdprcal
