// Predicted accuracy against what the estimator then achieves, and choices against exhaustive ones.
#include "cdprcal/planning/observability.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>

#include "../support/plan_robots.hpp"
#include "cdprcal/decompositions.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal {
namespace {

struct Setting {
  Robot robot = load_robot("irma4");
  SetPointSolver solver{robot};
  SetPoint start = *solver.at({0.0, 0.0, 0.9}).set_point;
  std::vector<SetPoint> grid(const std::array<int, 3>& counts) const {
    return test::set_points_in(solver, *published_measurement_box(robot), counts);
  }
};

TEST(Observability, ContributionsAddUpToTheEstimatorsCovariance) {
  const Setting s;
  const Observability observability(s.robot, s.start);
  for (const std::array<int, 3>& counts :
       std::vector<std::array<int, 3>>{{1, 1, 1}, {2, 1, 2}, {2, 2, 2}, {3, 3, 3}}) {
    const auto grid = s.grid(counts);
    Eigen::MatrixXd sum = observability.of_start();
    for (const SetPoint& point : grid) sum += observability.added_by(point);
    const Matrix6 covariance = Observability::on_initial_pose(sum).inverse();
    const auto expected = predicted_covariance(s.robot, s.start, grid);
    ASSERT_TRUE(expected);
    EXPECT_LT((covariance - *expected).norm(), 1e-9 * expected->norm());
  }
}

/// Where the platform rests when a small wrench [N, Nm] acts on it besides, to first order.
Pose pushed(const Robot& robot, const SetPoint& at, const Vector6& wrench) {
  const Matrix6 hessian = stiffness(robot, platform_state(robot, at.pose), at.tension_N);
  return plus(at.pose, Eigen::PartialPivLU<Matrix6>(hessian).solve(wrench));
}

TEST(Observability, TheEstimatorIsAsAccurateAsPredicted) {
  // Many calibrations with everything noisy that the estimator takes for noisy: the readings, and
  // the balance itself (an unknown wrench at each pose). Errors of ζ0, whitened by the predicted
  // covariance, must be chi-square.
  Setting s;
  SensorSigma& sigma = s.robot.sigma;
  for (double* one : {&sigma.length_m, &sigma.swivel_rad, &sigma.attitude_rad, &sigma.tension_N,
                      &sigma.wrench_force_N, &sigma.wrench_moment_Nm}) {
    *one *= 0.05;  // small, so that the model is as good as linear
  }
  const auto grid = s.grid({2, 2, 2});
  const Matrix6 covariance = *predicted_covariance(s.robot, s.start, grid);
  RandomNormal random(11);
  constexpr int kTrials = 150;
  double sum = 0.0;
  Vector6 square = Vector6::Zero();
  for (int trial = 0; trial < kTrials; ++trial) {
    CalibrationProblem problem;
    problem.robot = s.robot;
    std::vector<Pose> truth;
    const ReadingOffsets offsets = random_offsets(4, random);
    const auto measure = [&](const SetPoint& at) {
      Vector6 wrench;
      for (int a = 0; a < 6; ++a) {
        wrench[a] = (a < 3 ? sigma.wrench_force_N : sigma.wrench_moment_Nm) * random();
      }
      truth.push_back(pushed(s.robot, at, wrench));
      problem.measurements.push_back(synthetic_measurement(s.robot, truth.back(), at.tension_N,
                                                           PoseKind::static_pose, offsets,
                                                           reading_noise(sigma), random));
    };
    measure(s.start);
    for (const SetPoint& at : grid) measure(at);
    const CalibrationResult result = solve(problem, truth);
    ASSERT_EQ(result.status, CalibrationStatus::converged) << result.reason;
    const Vector6 error = minus(result.poses[0], truth[0]);
    sum += error.dot(solve_symmetric(covariance, error));
    square += error.cwiseAbs2();
  }
  // Mean of chi-square with 6 degrees of freedom: 6 ± √(12/150) = 6 ± 0.28.
  EXPECT_NEAR(sum / kTrials, 6.0, 4.0 * 0.29);
  const Vector6 ratio = (square / kTrials).cwiseSqrt().cwiseQuotient(square_roots(covariance));
  for (int a = 0; a < 6; ++a) EXPECT_NEAR(ratio[a], 1.0, 4.0 / std::sqrt(2.0 * kTrials));
}

TEST(Observability, MorePosesNeverKnowLess) {
  const Setting s;
  const auto grid = s.grid({3, 3, 3});
  Vector6 before = Vector6::Constant(HUGE_VAL);
  for (std::size_t count = 1; count <= grid.size(); count += 2) {
    const Vector6 now = square_roots(predicted_covariance(
        s.robot, s.start, {grid.begin(), grid.begin() + static_cast<std::ptrdiff_t>(count)}));
    for (int a = 0; a < 6; ++a) EXPECT_LE(now[a], before[a] * (1.0 + 1e-9));
    before = now;
  }
}

TEST(DOptimal, IsTheBestSetOfAnExhaustiveSearch) {
  const Setting s;
  const Observability observability(s.robot, s.start);
  std::vector<Eigen::MatrixXd> information;
  for (const SetPoint& point : s.grid({3, 2, 2}))
    information.push_back(observability.added_by(point));
  const int n = static_cast<int>(information.size());
  const auto log_determinant = [&](const std::vector<int>& set) {
    Eigen::MatrixXd sum = observability.of_start();
    for (const int c : set) sum += information[c];
    return std::log(Observability::on_initial_pose(sum).determinant());
  };
  for (int count = 1; count <= 4; ++count) {
    double best = -HUGE_VAL;
    for (int mask = 0; mask < 1 << n; ++mask) {
      std::vector<int> set;
      for (int c = 0; c < n; ++c) {
        if ((mask >> c & 1) != 0) set.push_back(c);
      }
      if (static_cast<int>(set.size()) == count) best = std::max(best, log_determinant(set));
    }
    const Selection selection = select_d_optimal(observability.of_start(), information, count);
    ASSERT_EQ(static_cast<int>(selection.chosen.size()), count);
    EXPECT_NEAR(log_determinant(selection.chosen), best, 1e-6) << count << " poses";
    EXPECT_EQ(selection.chosen,
              select_d_optimal(observability.of_start(), information, count).chosen);
  }
}

TEST(DOptimal, ChoosesEachCandidateAtMostOnce) {
  const Setting s;
  const Observability observability(s.robot, s.start);
  std::vector<Eigen::MatrixXd> information;
  for (const SetPoint& point : s.grid({2, 2, 2}))
    information.push_back(observability.added_by(point));
  std::vector<int> all = select_d_optimal(observability.of_start(), information, 8).chosen;
  std::sort(all.begin(), all.end());
  EXPECT_EQ(all, (std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_THROW((void)select_d_optimal(observability.of_start(), information, 9), InputError);
  EXPECT_THROW((void)select_d_optimal(observability.of_start(), information, 0), InputError);
}

}  // namespace
}  // namespace cdprcal
