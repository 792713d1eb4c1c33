// Decompositions of matrices. They are Eigen's, compiled once: they take seconds in every file that
// instantiates one, more those of an expression.
#pragma once

#include <optional>
#include <utility>

#include "cdprcal/types.hpp"

namespace cdprcal {

/// Up to six by six, without memory of its own.
using SmallSquare = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;

/// One number a row of a matrix.
template <typename Matrix>
using ColumnOf = Eigen::Matrix<double, Matrix::RowsAtCompileTime, 1, Eigen::ColMajor,
                               Matrix::MaxRowsAtCompileTime, 1>;

/// Eigenvalues, ascending, and eigenvectors, the columns, of a symmetric matrix, of which the lower
/// half is read.
template <typename Matrix>
class SymmetricEigen {
 public:
  explicit SymmetricEigen(const Matrix& matrix);
  SymmetricEigen(ColumnOf<Matrix> values, Matrix vectors)
      : values_(std::move(values)), vectors_(std::move(vectors)) {}

  [[nodiscard]] const ColumnOf<Matrix>& eigenvalues() const { return values_; }
  [[nodiscard]] const Matrix& eigenvectors() const { return vectors_; }

 private:
  ColumnOf<Matrix> values_;
  Matrix vectors_;
};

/// The same without eigenvectors.
template <typename Matrix>
ColumnOf<Matrix> symmetric_eigenvalues(const Matrix& matrix);

/// A v = λ B v with vᵀ B v = 1; both symmetric, B positive definite.
template <typename Matrix>
SymmetricEigen<Matrix> symmetric_eigen(const Matrix& a, const Matrix& b);

/// A = L Lᵀ of a symmetric, positive definite matrix.
template <typename Matrix>
class Cholesky {
 public:
  Cholesky() = default;
  explicit Cholesky(const Matrix& matrix);

  /// Whether the matrix was positive definite.
  [[nodiscard]] bool ok() const { return ok_; }
  /// A⁻¹ b.
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const;
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& right) const;
  [[nodiscard]] double log_determinant() const;

 private:
  Matrix lower_;  ///< L; its upper half means nothing
  bool ok_ = false;
};

/// A⁻¹ b of a symmetric, positive semidefinite matrix (L D Lᵀ with pivots).
Eigen::MatrixXd solve_symmetric(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
Vector6 solve_symmetric(const Matrix6& a, const Vector6& b);

/// A⁻¹ b of a square matrix (L U with pivots).
Vector6 solve_square(const Matrix6& a, const Vector6& b);
Eigen::MatrixXd solve_square(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
Eigen::MatrixXd inverse(const Eigen::MatrixXd& a);

/// A⁺ (complete orthogonal decomposition).
Matrix6 pseudo_inverse(const Matrix6& a);
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& a);

/// A⁺ b: of all x that come nearest to A x = b the shortest.
Vector6 least_norm(const Matrix6& a, const Vector6& b);
Eigen::MatrixXd least_norm(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);
Eigen::VectorXd least_norm(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// An x that comes nearest to A x = b, and how many columns of A are independent.
struct LeastSquares {
  Eigen::VectorXd x;
  Eigen::Index rank = 0;
};
LeastSquares least_squares(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// Orthonormal columns that span what the columns of A span, and what is across it. `tolerance`: of
/// the largest pivot, below which a column adds nothing; rounding by default.
Eigen::MatrixXd range_basis(const Eigen::MatrixXd& a, std::optional<double> tolerance = {});
Eigen::MatrixXd basis_across(const Eigen::MatrixXd& a, std::optional<double> tolerance = {});

/// Orthogonal, its first columns by Gram and Schmidt those of the matrix, but for signs.
Eigen::MatrixXd householder_q(const Eigen::MatrixXd& columns);

extern template class SymmetricEigen<Matrix3>;
extern template class SymmetricEigen<Matrix6>;
extern template class SymmetricEigen<SmallSquare>;
extern template class SymmetricEigen<CableMatrix>;
extern template class SymmetricEigen<Eigen::MatrixXd>;
extern template class Cholesky<SmallSquare>;
extern template class Cholesky<Eigen::MatrixXd>;

}  // namespace cdprcal
