// Singular values of a matrix: Eigen's, compiled once, as other decompositions.
#pragma once

#include "cdprcal/decompositions.hpp"

namespace cdprcal {

/// A = U diag(values) Vᵀ, values descending.
template <typename Matrix>
struct Svd {
  Matrix u;
  ColumnOf<Matrix> values;
  Matrix v;
  Eigen::Index rank = 0;  ///< values beyond rounding
};
Svd<Matrix3> svd(const Matrix3& a);
Svd<Eigen::MatrixXd> svd(const Eigen::MatrixXd& a);
/// Without the columns of U and V that no value has.
Svd<Eigen::MatrixXd> thin_svd(const Eigen::MatrixXd& a);

}  // namespace cdprcal
