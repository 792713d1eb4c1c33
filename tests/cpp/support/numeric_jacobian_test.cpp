// The harness itself: it must find right derivatives, and must not accept wrong or vague ones.
#include "numeric_jacobian.hpp"

namespace cdprcal::test {
namespace {

Eigen::VectorXd example(const Eigen::VectorXd& x) {
  return Eigen::Vector3d(std::sin(3.0 * x[0]) * x[1], std::exp(x[0] - x[1]), 5.0);
}

Eigen::MatrixXd example_jacobian(const Eigen::VectorXd& x) {
  Eigen::MatrixXd j(3, 2);
  j << 3.0 * std::cos(3.0 * x[0]) * x[1], std::sin(3.0 * x[0]), std::exp(x[0] - x[1]),
      -std::exp(x[0] - x[1]), 0.0, 0.0;
  return j;
}

TEST(NumericJacobian, FindsKnownDerivativesTo1e10) {
  const Eigen::Vector2d x(0.3, -1.2);
  EXPECT_TRUE(jacobian_matches(example_jacobian(x), numeric_jacobian(example, x), 1e-10));
}

TEST(NumericJacobian, RefusesAnErrorOfOnePartInAMillion) {
  const Eigen::Vector2d x(0.3, -1.2);
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 2; ++j) {
      Eigen::MatrixXd wrong = example_jacobian(x);
      wrong(i, j) += 1e-6 * std::max(1.0, std::abs(wrong(i, j)));
      EXPECT_FALSE(jacobian_matches(wrong, numeric_jacobian(example, x)));
    }
  }
}

TEST(NumericJacobian, RefusesNaNsShapesAndFunctionsThatAreNotSmooth) {
  const Eigen::VectorXd x = Eigen::VectorXd::Zero(1);
  const auto nan = [](const Eigen::VectorXd&) { return std::nan(""); };
  EXPECT_FALSE(jacobian_matches(Eigen::MatrixXd::Zero(1, 1), numeric_jacobian(nan, x)));
  const auto root = [](const Eigen::VectorXd& v) { return std::cbrt(v[0]); };
  const auto vague = numeric_jacobian(root, x);
  EXPECT_FALSE(jacobian_matches(vague.value, vague));
  const auto constant = [](const Eigen::VectorXd&) { return 1.0; };
  EXPECT_FALSE(jacobian_matches(Eigen::MatrixXd::Zero(1, 2), numeric_jacobian(constant, x)));
  EXPECT_TRUE(jacobian_matches(Eigen::MatrixXd::Zero(1, 1), numeric_jacobian(constant, x)));
  EXPECT_FALSE(
      jacobian_matches(Eigen::MatrixXd::Constant(1, 1, kNaN), numeric_jacobian(constant, x)));
}

TEST(NumericJacobian, PoseColumnsAreAWorldFrameTwist) {
  const Pose pose{{0.1, 0.2, 0.3}, exp_so3({0.4, -0.5, 0.6})};
  const Vector3 point(0.7, -0.2, 0.4);
  const auto world = [&](const Pose& p) { return Vector3(p.position_m + p.rotation * point); };
  Eigen::Matrix<double, 3, 6> expected;
  expected << Matrix3::Identity(), -skew(pose.rotation * point);
  EXPECT_TRUE(jacobian_matches(expected, numeric_pose_jacobian(world, pose), 1e-10));
}

TEST(NumericJacobian, HessianOfAKnownFunction) {
  const auto f = [](const Eigen::VectorXd& d) {
    return 1e3 + d[0] * d[0] * 3.0 + 2.0 * d[0] * d[1] + std::cos(d[1]);
  };
  Eigen::Matrix2d expected;
  expected << 6.0, 2.0, 2.0, -1.0;
  EXPECT_TRUE(jacobian_matches(expected, numeric_tangent_hessian(f, 2), 1e-9));
  expected(0, 1) += 0.1;
  EXPECT_FALSE(jacobian_matches(expected, numeric_tangent_hessian(f, 2), 1e-6));
}

}  // namespace
}  // namespace cdprcal::test
