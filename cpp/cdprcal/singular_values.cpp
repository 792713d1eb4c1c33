#include "cdprcal/singular_values.hpp"

#include <Eigen/SVD>

namespace cdprcal {

Svd<Matrix3> svd(const Matrix3& a) {
  const Eigen::JacobiSVD<Matrix3> found(a, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {found.matrixU(), found.singularValues(), found.matrixV(), found.rank()};
}
Svd<Eigen::MatrixXd> svd(const Eigen::MatrixXd& a) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> found(a, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {found.matrixU(), found.singularValues(), found.matrixV(), found.rank()};
}
Svd<Eigen::MatrixXd> thin_svd(const Eigen::MatrixXd& a) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> found(a, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {found.matrixU(), found.singularValues(), found.matrixV(), found.rank()};
}

}  // namespace cdprcal
