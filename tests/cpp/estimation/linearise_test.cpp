// The calibration as plain linear algebra, against what the solver makes of it.
#include "cdprcal/estimation/linearise.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "../support/scenario.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal::test {
namespace {

class Linearise : public ::testing::Test {
 protected:
  void SetUp() override {
    s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.3, 17);
    result = solve(s.problem, s.truth);
    ASSERT_EQ(result.status, CalibrationStatus::converged) << result.reason;
  }
  Scenario s;
  CalibrationResult result;
};

TEST_F(Linearise, AtTheMinimumIsTheSolversOwn) {
  const LinearisedProblem rows = linearise(s.problem, result.poses, result.reference_errors);
  ASSERT_EQ(rows.residual.size(), rows.jacobian.rows());
  ASSERT_EQ(rows.jacobian.cols(), 6 * 9 + 2 * 4 + 1);
  // ½ rᵀr is the cost, Jᵀr its gradient, and the inverse of JᵀJ the covariance: of ζ0 here.
  EXPECT_NEAR(0.5 * rows.residual.squaredNorm(), result.cost, 1e-6 * result.cost);
  const Eigen::MatrixXd normal = rows.jacobian.transpose() * rows.jacobian;
  const Eigen::VectorXd gradient = rows.jacobian.transpose() * rows.residual;
  const Eigen::VectorXd step = normal.fullPivLu().solve(gradient);
  EXPECT_LT(gradient.dot(step), 1e-6) << "nothing is left to gain";
  const Matrix6 covariance = normal.inverse().topLeftCorner<6, 6>();
  EXPECT_LT((covariance - *result.covariance).norm(), 1e-5 * result.covariance->norm());
}

TEST_F(Linearise, ItsJacobianIsTheDerivativeOfItsResidual) {
  // Along a direction of all unknowns at once. The wrench rows are whitened at the poses given, so
  // the weights change with them: without balance here.
  s.problem.statics = StaticsModel::none;
  const LinearisedProblem at = linearise(s.problem, s.truth);
  RandomNormal random(3);
  Eigen::VectorXd direction(at.jacobian.cols());
  for (double& v : direction) v = random();
  const auto residual = [&](double h) {
    std::vector<Pose> poses;
    for (std::size_t i = 0; i < s.truth.size(); ++i) {
      const Vector6 twist = h * direction.segment<6>(6 * static_cast<Eigen::Index>(i));
      poses.push_back(plus(s.truth[i], twist));
    }
    const Eigen::VectorXd errors = h * direction.tail(9);
    return linearise(s.problem, poses, errors).residual;
  };
  const double h = 1e-5;
  const Eigen::VectorXd numeric = (residual(h) - residual(-h)) / (2.0 * h);
  EXPECT_LT((numeric - at.jacobian * direction).norm(), 1e-6 * numeric.norm());
}

TEST_F(Linearise, RefusesWhatSolveWould) {
  std::vector<Pose> few(s.truth.begin(), s.truth.end() - 1);
  EXPECT_THROW((void)linearise(s.problem, few), InputError);
  EXPECT_THROW((void)linearise(s.problem, s.truth, Eigen::VectorXd::Zero(8)), InputError);
  // No geometry, no numbers: the anchor of a cable inside of its pulley.
  std::vector<Pose> inside = s.truth;
  const Cable& cable = s.problem.robot.cables[0];
  inside[3].position_m = cable.pulley.position_m -
                         inside[3].rotation_matrix() * cable.platform_anchor_m +
                         0.5 * cable.pulley.radius_m * cable.pulley.x_axis();
  EXPECT_TRUE(linearise(s.problem, inside).residual.hasNaN());
}

}  // namespace
}  // namespace cdprcal::test
