#include "cdprcal/decompositions.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

namespace cdprcal {

using Eigen::MatrixXd;
using Eigen::VectorXd;

template <typename Matrix>
SymmetricEigen<Matrix>::SymmetricEigen(const Matrix& matrix) {
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(matrix);
  values_ = eigen.eigenvalues();
  vectors_ = eigen.eigenvectors();
}

template <typename Matrix>
ColumnOf<Matrix> symmetric_eigenvalues(const Matrix& matrix) {
  return Eigen::SelfAdjointEigenSolver<Matrix>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
}

template <typename Matrix>
SymmetricEigen<Matrix> symmetric_eigen(const Matrix& a, const Matrix& b) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix> eigen(a, b);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

template <typename Matrix>
Cholesky<Matrix>::Cholesky(const Matrix& matrix) {
  const Eigen::LLT<Matrix> factor(matrix);
  ok_ = factor.info() == Eigen::Success;
  lower_ = factor.matrixLLT();
}

namespace {

/// (L Lᵀ)⁻¹ times some columns.
template <typename Matrix, typename Columns>
Columns twice_solved(const Matrix& lower, Columns columns) {
  if (columns.size() == 0) return columns;  // Eigen binds to their first
  lower.template triangularView<Eigen::Lower>().solveInPlace(columns);
  lower.template triangularView<Eigen::Lower>().adjoint().solveInPlace(columns);
  return columns;
}

}  // namespace

template <typename Matrix>
MatrixXd Cholesky<Matrix>::solve(const MatrixXd& right) const {
  return twice_solved(lower_, right);
}

template <typename Matrix>
VectorXd Cholesky<Matrix>::solve(const VectorXd& right) const {
  return twice_solved(lower_, right);
}

template <typename Matrix>
double Cholesky<Matrix>::log_determinant() const {
  return 2.0 * lower_.diagonal().array().log().sum();
}

MatrixXd solve_symmetric(const MatrixXd& a, const MatrixXd& b) { return a.ldlt().solve(b); }
VectorXd solve_symmetric(const MatrixXd& a, const VectorXd& b) { return a.ldlt().solve(b); }
Vector6 solve_symmetric(const Matrix6& a, const Vector6& b) { return a.ldlt().solve(b); }

Vector6 solve_square(const Matrix6& a, const Vector6& b) { return a.partialPivLu().solve(b); }
MatrixXd solve_square(const MatrixXd& a, const MatrixXd& b) { return a.partialPivLu().solve(b); }
MatrixXd inverse(const MatrixXd& a) { return a.inverse(); }

// Decompositions with pivots, from here on, would look for the largest of no columns.

Matrix6 pseudo_inverse(const Matrix6& a) {
  return a.completeOrthogonalDecomposition().pseudoInverse();
}
MatrixXd pseudo_inverse(const MatrixXd& a) {
  if (a.size() == 0) return MatrixXd::Zero(a.cols(), a.rows());
  return a.completeOrthogonalDecomposition().pseudoInverse();
}

Vector6 least_norm(const Matrix6& a, const Vector6& b) {
  return a.completeOrthogonalDecomposition().solve(b);
}
MatrixXd least_norm(const MatrixXd& a, const MatrixXd& b) {
  if (a.size() == 0) return MatrixXd::Zero(a.cols(), b.cols());
  return a.completeOrthogonalDecomposition().solve(b);
}
VectorXd least_norm(const MatrixXd& a, const VectorXd& b) {
  if (a.size() == 0) return VectorXd::Zero(a.cols());
  return a.completeOrthogonalDecomposition().solve(b);
}

LeastSquares least_squares(const MatrixXd& a, const VectorXd& b) {
  if (a.size() == 0) return {VectorXd::Zero(a.cols()), 0};
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(a);
  return {qr.solve(b), qr.rank()};
}

namespace {

Eigen::ColPivHouseholderQR<MatrixXd> pivoted(const MatrixXd& a, std::optional<double> tolerance) {
  Eigen::ColPivHouseholderQR<MatrixXd> qr(a);
  if (tolerance) qr.setThreshold(*tolerance);
  return qr;
}

}  // namespace

MatrixXd range_basis(const MatrixXd& a, std::optional<double> tolerance) {
  if (a.size() == 0) return MatrixXd(a.rows(), 0);
  const Eigen::ColPivHouseholderQR<MatrixXd> qr = pivoted(a, tolerance);
  return qr.householderQ() * MatrixXd::Identity(a.rows(), qr.rank());
}

MatrixXd basis_across(const MatrixXd& a, std::optional<double> tolerance) {
  if (a.size() == 0) return MatrixXd::Identity(a.rows(), a.rows());
  const Eigen::ColPivHouseholderQR<MatrixXd> qr = pivoted(a, tolerance);
  const MatrixXd q = qr.householderQ();
  return q.rightCols(a.rows() - qr.rank());
}

MatrixXd householder_q(const MatrixXd& columns) {
  return Eigen::HouseholderQR<MatrixXd>(columns).householderQ();
}

template class SymmetricEigen<Matrix3>;
template class SymmetricEigen<Matrix6>;
template class SymmetricEigen<SmallSquare>;
template class SymmetricEigen<CableMatrix>;
template class SymmetricEigen<MatrixXd>;
template ColumnOf<Matrix3> symmetric_eigenvalues(const Matrix3&);
template ColumnOf<Matrix6> symmetric_eigenvalues(const Matrix6&);
template ColumnOf<SmallSquare> symmetric_eigenvalues(const SmallSquare&);
template SymmetricEigen<SmallSquare> symmetric_eigen(const SmallSquare&, const SmallSquare&);
template SymmetricEigen<MatrixXd> symmetric_eigen(const MatrixXd&, const MatrixXd&);
template class Cholesky<SmallSquare>;
template class Cholesky<MatrixXd>;

}  // namespace cdprcal
