// What friction and hysteresis leave open of the initial pose.
#include "cdprcal/evidence/directions.hpp"

#include <gtest/gtest.h>

#include "../support/run.hpp"
#include "cdprcal/diagnosis/baseline.hpp"
#include "cdprcal/geometry/pose.hpp"

namespace cdprcal {
namespace {

DiagnosisModel fitted() {
  std::vector<Log> logs{test::startup_log(load_robot("irma4"), 0.05, 422, 0)};
  std::vector<std::string> left_out;
  return baseline_model(load_robot("irma4"), logs, left_out);
}

TEST(UncertainDirections, NothingHangsOnThemWithoutFriction) {
  const UncertainDirections found = uncertain_directions(fitted());
  EXPECT_TRUE(found.covariance.isZero(0.0));
  EXPECT_EQ(found.variance.size(), 0);
}

TEST(UncertainDirections, ASwivelThatLaggedBeforePowerOnReadsSoMuchElse) {
  constexpr double kHalf_rad = 0.01;
  const DiagnosisModel plain = fitted();
  DiagnosisModel lagging = plain;
  lagging.runs[0].known.push_back(
      {find_effect("swivel_hysteresis"), EffectValues::Constant(1, kHalf_rad)});
  ASSERT_TRUE(fit(lagging));
  const Matrix6 found = uncertain_directions(lagging).covariance;
  // The same by another way: the readings themselves are off.
  Matrix6 expected = Matrix6::Zero();
  for (int i = 0; i < 4; ++i) {
    DiagnosisModel other = lagging;
    for (Measurement& m : other.runs[0].measurements) {
      m.swivel_rad[i] += kHalf_rad * m.swivel_direction_open[i];
    }
    ASSERT_TRUE(fit(other));
    const Vector6 shift = minus(other.runs[0].poses[0], lagging.runs[0].poses[0]);
    expected += shift * shift.transpose();
  }
  EXPECT_GT(expected.norm(), 0.0);
  const Vector6 sigma = expected.diagonal().cwiseSqrt();
  // What the estimate of the directions may be off comes on top.
  for (int axis = 0; axis < 6; ++axis) {
    EXPECT_GE(std::sqrt(found(axis, axis)), 0.98 * sigma[axis]);
    EXPECT_LE(std::sqrt(found(axis, axis)), 1.5 * sigma[axis]);
  }
}

}  // namespace
}  // namespace cdprcal
