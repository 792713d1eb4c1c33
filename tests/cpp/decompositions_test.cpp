// What decompositions promise, on random matrices: by their definitions.
#include "cdprcal/decompositions.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>

#include "cdprcal/singular_values.hpp"

namespace cdprcal {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kExact = 1e-10;

/// rows × cols of the given rank.
MatrixXd of_rank(Eigen::Index rows, Eigen::Index cols, Eigen::Index rank) {
  return MatrixXd::Random(rows, rank) * MatrixXd::Random(rank, cols);
}

MatrixXd positive(Eigen::Index size) {
  const MatrixXd root = MatrixXd::Random(size, size + 2);
  return root * root.transpose() + 0.1 * MatrixXd::Identity(size, size);
}

MatrixXd identity(Eigen::Index size) { return MatrixXd::Identity(size, size); }

template <typename Matrix>
void expect_eigen(const Matrix& a) {
  const SymmetricEigen<Matrix> eigen(a);
  EXPECT_TRUE((a * eigen.eigenvectors())
                  .isApprox(eigen.eigenvectors() * eigen.eigenvalues().asDiagonal(), kExact));
  EXPECT_TRUE((eigen.eigenvectors().transpose() * eigen.eigenvectors())
                  .isApprox(identity(a.rows()), kExact));
  EXPECT_TRUE(std::is_sorted(eigen.eigenvalues().begin(), eigen.eigenvalues().end()));
}

TEST(Decompositions, EigenvectorsAreKeptInDirectionAndSorted) {
  expect_eigen<Matrix3>(positive(3));
  expect_eigen<Matrix6>(positive(6));
  expect_eigen<SmallSquare>(positive(2));
  expect_eigen<CableMatrix>(positive(8));
  expect_eigen<MatrixXd>(positive(11));
}

TEST(Decompositions, EigenvaluesAloneAreTheSame) {
  const Matrix3 three = positive(3);
  EXPECT_TRUE(symmetric_eigenvalues(three).isApprox(SymmetricEigen<Matrix3>(three).eigenvalues()));
  const Matrix6 six = positive(6);
  EXPECT_TRUE(symmetric_eigenvalues(six).isApprox(SymmetricEigen<Matrix6>(six).eigenvalues()));
  const SmallSquare some = positive(5);
  EXPECT_TRUE(
      symmetric_eigenvalues(some).isApprox(SymmetricEigen<SmallSquare>(some).eigenvalues()));
}

TEST(Decompositions, EigenvectorsInAMetricAreOrthonormalInIt) {
  const MatrixXd a = positive(5), b = positive(5);
  const SymmetricEigen<MatrixXd> eigen = symmetric_eigen(a, b);
  const MatrixXd& v = eigen.eigenvectors();
  EXPECT_TRUE((a * v).isApprox(b * v * eigen.eigenvalues().asDiagonal(), kExact));
  EXPECT_TRUE((v.transpose() * b * v).isApprox(identity(5), kExact));
}

TEST(Decompositions, CholeskySolvesAndTellsWhatIsNotPositive) {
  const MatrixXd a = positive(7), right = MatrixXd::Random(7, 3);
  const Cholesky<MatrixXd> factor(a);
  ASSERT_TRUE(factor.ok());
  EXPECT_TRUE((a * factor.solve(right)).isApprox(right, kExact));
  EXPECT_TRUE((a * factor.solve(VectorXd(right.col(1)))).isApprox(right.col(1), kExact));
  EXPECT_NEAR(factor.log_determinant(), std::log(a.determinant()), kExact);
  EXPECT_FALSE(Cholesky<MatrixXd>(-a).ok());
  EXPECT_FALSE(Cholesky<MatrixXd>().ok());
  const SmallSquare small = positive(4);
  EXPECT_TRUE((small * Cholesky<SmallSquare>(small).solve(MatrixXd(identity(4))))
                  .isApprox(identity(4), kExact));
}

TEST(Decompositions, SystemsAreSolved) {
  const MatrixXd a = positive(6), square = MatrixXd::Random(6, 6), right = MatrixXd::Random(6, 2);
  const VectorXd one = right.col(0);
  EXPECT_TRUE((a * solve_symmetric(a, right)).isApprox(right, kExact));
  EXPECT_TRUE((a * solve_symmetric(a, one)).isApprox(one, kExact));
  EXPECT_TRUE((a * solve_symmetric(Matrix6(a), Vector6(one))).isApprox(one, kExact));
  EXPECT_TRUE((square * solve_square(square, right)).isApprox(right, kExact));
  EXPECT_TRUE((square * solve_square(Matrix6(square), Vector6(one))).isApprox(one, kExact));
  EXPECT_TRUE((square * inverse(square)).isApprox(identity(6), kExact));
}

/// The four conditions of Moore and Penrose.
void expect_pseudo_inverse(const MatrixXd& a, const MatrixXd& p) {
  EXPECT_TRUE((a * p * a).isApprox(a, kExact));
  EXPECT_TRUE((p * a * p).isApprox(p, kExact));
  EXPECT_TRUE((a * p).isApprox((a * p).transpose(), kExact));
  EXPECT_TRUE((p * a).isApprox((p * a).transpose(), kExact));
}

TEST(Decompositions, PseudoInversesAreMooresAndPenroses) {
  for (const MatrixXd& a : {of_rank(9, 4, 4), of_rank(4, 9, 3), of_rank(6, 6, 5)}) {
    expect_pseudo_inverse(a, pseudo_inverse(a));
    const MatrixXd right = MatrixXd::Random(a.rows(), 2);
    const VectorXd one = right.col(0);
    EXPECT_TRUE(least_norm(a, right).isApprox(pseudo_inverse(a) * right, kExact));
    EXPECT_TRUE(least_norm(a, one).isApprox(pseudo_inverse(a) * one, kExact));
  }
  const Matrix6 six = of_rank(6, 6, 4);
  const Vector6 right = Vector6::Random();
  expect_pseudo_inverse(six, pseudo_inverse(six));
  EXPECT_TRUE(least_norm(six, right).isApprox(pseudo_inverse(six) * right, kExact));
}

TEST(Decompositions, LeastSquaresLeaveWhatNoColumnReaches) {
  const MatrixXd a = of_rank(8, 5, 3);
  const VectorXd right = VectorXd::Random(8);
  const LeastSquares found = least_squares(a, right);
  EXPECT_EQ(found.rank, 3);
  EXPECT_NEAR((a.transpose() * (right - a * found.x)).norm(), 0.0, kExact);
}

TEST(Decompositions, BasesSpanTheRangeAndWhatIsAcross) {
  const MatrixXd a = of_rank(7, 5, 3);
  const MatrixXd range = range_basis(a), across = basis_across(a);
  ASSERT_EQ(range.cols(), 3);
  ASSERT_EQ(across.cols(), 4);
  EXPECT_TRUE((range.transpose() * range).isApprox(identity(3), kExact));
  EXPECT_TRUE((across.transpose() * across).isApprox(identity(4), kExact));
  EXPECT_TRUE((range * range.transpose() * a).isApprox(a, kExact));
  EXPECT_NEAR((across.transpose() * a).norm(), 0.0, kExact);
  // What is small against the largest is none by a coarser measure.
  MatrixXd nearly = identity(3);
  nearly(2, 2) = 1e-4;
  EXPECT_EQ(range_basis(nearly).cols(), 3);
  EXPECT_EQ(range_basis(nearly, 1e-3).cols(), 2);
  EXPECT_EQ(basis_across(nearly, 1e-3).cols(), 1);
}

TEST(Decompositions, WithoutColumnsNothingIsSpanned) {
  const MatrixXd none(6, 0), of_none(0, 6);
  const VectorXd right = VectorXd::Ones(6);
  EXPECT_EQ(least_squares(none, right).x.size(), 0);
  EXPECT_EQ(least_norm(none, right).size(), 0);
  EXPECT_EQ(least_norm(of_none, MatrixXd(0, 2)), MatrixXd::Zero(6, 2));
  EXPECT_EQ(least_norm(of_none, VectorXd(0)), VectorXd::Zero(6));
  EXPECT_EQ(pseudo_inverse(none).rows(), 0);
  EXPECT_EQ(pseudo_inverse(of_none), MatrixXd::Zero(6, 0));
  EXPECT_EQ(range_basis(none).cols(), 0);
  EXPECT_EQ(basis_across(none), identity(6));
  EXPECT_EQ(householder_q(none), identity(6));
}

TEST(Decompositions, HouseholdersQKeepsTheSpansOfFirstColumns) {
  const MatrixXd a = MatrixXd::Random(6, 3), q = householder_q(a);
  EXPECT_TRUE((q.transpose() * q).isApprox(identity(6), kExact));
  for (int k = 1; k <= 3; ++k) {
    const auto first = q.leftCols(k);
    EXPECT_TRUE((first * first.transpose() * a.leftCols(k)).isApprox(a.leftCols(k), kExact));
  }
}

TEST(Decompositions, SingularValuesDescendAndMakeTheMatrix) {
  const MatrixXd a = of_rank(5, 7, 3);
  const Svd full = svd(a), thin = thin_svd(a);
  EXPECT_EQ(full.rank, 3);
  EXPECT_EQ(full.u.cols(), 5);
  EXPECT_EQ(full.v.cols(), 7);
  EXPECT_EQ(thin.v.cols(), 5);
  EXPECT_TRUE((full.v.transpose() * full.v).isApprox(identity(7), kExact));
  EXPECT_TRUE((thin.u * thin.values.asDiagonal() * thin.v.transpose()).isApprox(a, kExact));
  EXPECT_TRUE(std::is_sorted(full.values.begin(), full.values.end(), std::greater<>()));
  const MatrixXd three = MatrixXd::Random(3, 3);
  const Svd of_three = svd(three);
  EXPECT_TRUE(
      (of_three.u * of_three.values.asDiagonal() * of_three.v.transpose()).isApprox(three, kExact));
}

}  // namespace
}  // namespace cdprcal
