// What the readings allow beside a minimum, held against what its slope says.
#include "cdprcal/estimation/curvature.hpp"

#include <gtest/gtest.h>

#include "../support/scenario.hpp"

namespace cdprcal::test {
namespace {

/// Eight poses of irma4 with so much of eq. 18's noise, `kind` of them; the slope's covariance.
std::pair<CalibrationProblem, CalibrationResult> solved(PoseKind kind, double noise) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), kind, noise, 5);
  if (kind == PoseKind::kinematic_pose) s.problem.statics = StaticsModel::none;
  s.problem.reference_attitude = s.problem.reference_statics = s.problem.reference_noise = true;
  CalibrationResult result = solve(s.problem, s.truth);
  return {std::move(s.problem), std::move(result)};
}

TEST(Nearby, WhereAllRotationsAreKnownTheSlopeHolds) {
  const auto [problem, result] = solved(PoseKind::static_pose, 0.2);
  ASSERT_TRUE(result.covariance.has_value()) << result.reason;
  const Nearby there = nearby(problem, result);
  EXPECT_EQ(there.widening, 1.0);
  EXPECT_EQ(there.covariance, *result.covariance);
}

TEST(Nearby, ACovarianceThatIsTooSmallIsFoundOut) {
  auto [problem, result] = solved(PoseKind::kinematic_pose, 2e-3);
  ASSERT_TRUE(result.covariance.has_value()) << result.reason;
  ASSERT_GT(result.standard_deviation()[5], 2.0 * kDegree);  // yaw, which geometry hardly shows
  const Nearby honest = nearby(problem, result);
  EXPECT_LT(honest.widening, 1.3);
  // The same claims three quarters of the deviation: beside it the cost rises too little.
  const Matrix6 whole = honest.covariance;
  result.covariance = 0.5625 * *result.covariance;
  const Nearby found = nearby(problem, result);
  EXPECT_GT(found.widening, 1.25);
  EXPECT_GT(found.covariance(5, 5), 0.9 * whole(5, 5));
}

}  // namespace
}  // namespace cdprcal::test
