// Inverses of informations about numbers of very different units.
#include "cdprcal/estimation/symmetric_inverse.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "cdprcal/decompositions.hpp"

namespace cdprcal::test {
namespace {

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

TEST(SymmetricInverse, IsExactWhateverTheUnits) {
  constexpr Eigen::Index kSize = 30;
  const Eigen::MatrixXd rows = random_matrix(80, kSize, 1);
  const Eigen::MatrixXd plain = rows.transpose() * rows;
  // From micrometres to typical sizes: sixteen decades of information.
  const Eigen::VectorXd units =
      Eigen::VectorXd::LinSpaced(kSize, -8.0, 0.0).unaryExpr([](double e) {
        return std::pow(10.0, e);
      });
  const Eigen::MatrixXd inverse = symmetric_inverse(units.cwiseInverse().asDiagonal() * plain *
                                                    units.cwiseInverse().asDiagonal());
  const Eigen::MatrixXd expected = plain.inverse();
  const Eigen::MatrixXd found =
      units.cwiseInverse().asDiagonal() * inverse * units.cwiseInverse().asDiagonal();
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-9 * expected.cwiseAbs().maxCoeff());
  EXPECT_LT((found - found.transpose()).cwiseAbs().maxCoeff(), 1e-14 * found.maxCoeff());
}

TEST(SymmetricInverse, IsZeroAlongWhatNothingTells) {
  const Eigen::MatrixXd rows = random_matrix(3, 5, 2);  // of rank 3
  Eigen::MatrixXd information = rows.transpose() * rows;
  information.conservativeResize(6, 6);
  information.row(5).setZero();
  information.col(5).setZero();
  const Eigen::MatrixXd inverse = symmetric_inverse(information);
  EXPECT_TRUE(inverse.row(5).isZero());
  EXPECT_LT((information * inverse * information - information).cwiseAbs().maxCoeff(), 1e-10);
  const Eigen::VectorXd values = SymmetricEigen<Eigen::MatrixXd>(inverse).eigenvalues();
  EXPECT_GT(values[0], -1e-12 * values[5]);
  EXPECT_LT(values[2], 1e-10 * values[5]);
}

TEST(SymmetricInverse, LeavesWhatIsNotFinite) {
  EXPECT_EQ(symmetric_inverse(Eigen::MatrixXd()).size(), 0);
  EXPECT_FALSE(symmetric_inverse(Eigen::MatrixXd::Constant(2, 2, kNaN)).allFinite());
}

}  // namespace
}  // namespace cdprcal::test
