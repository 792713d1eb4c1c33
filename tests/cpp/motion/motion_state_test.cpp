// How a state in motion follows from the one before: derivatives and covariances.
#include "cdprcal/motion/motion_state.hpp"

#include "../support/numeric_jacobian.hpp"
#include "../support/random_motion.hpp"

namespace cdprcal::test {
namespace {

MotionVector difference(const MotionState& to, const MotionState& from) {
  MotionVector out;
  out << minus(to.pose, from.pose), to.twist - from.twist, to.acceleration - from.acceleration;
  return out;
}

TEST(MotionState, MovesAsConstantAccelerationDoes) {
  Rng rng(1);
  for (int i = 0; i < 20; ++i) {
    MotionState state = random_state(rng);
    state.acceleration.tail<3>() = 2.0 * state.twist.tail<3>();  // about one axis, turns add up
    const MotionVector apart = difference(moved(moved(state, 0.2), 0.3), moved(state, 0.5));
    EXPECT_LT(apart.norm(), 1e-12);
    EXPECT_LT(difference(moved(state, 0.0), state).norm(), 1e-12);
  }
}

TEST(MotionState, TransitionIsItsDerivative) {
  Rng rng(2);
  constexpr double kStep_s = 0.01;
  for (int i = 0; i < 20; ++i) {
    const MotionState state = random_state(rng);
    const MotionState expected = moved(state, kStep_s);
    const NumericJacobian numeric = numeric_tangent_jacobian(
        [&](const Eigen::VectorXd& delta) -> Eigen::VectorXd {
          return difference(moved(plus(state, delta), kStep_s), expected);
        },
        kMotionUnknowns);
    // The turn's own derivative is a series up to its square.
    EXPECT_TRUE(jacobian_matches(transition(state, kStep_s), numeric, 1e-6));
  }
}

TEST(MotionState, JerkCovarianceIsTheIntegralOfWhiteJerk) {
  for (const double duration_s : {0.01, 0.1, 1.0}) {
    constexpr int kPieces = 200;  // Simpson's rule
    Matrix3 sum = Matrix3::Zero();
    for (int i = 0; i <= 2 * kPieces; ++i) {
      const double left_s = duration_s * (1.0 - 0.5 * i / kPieces);
      const Vector3 reach(0.5 * left_s * left_s, left_s, 1.0);
      const double weight = i == 0 || i == 2 * kPieces ? 1.0 : i % 2 == 1 ? 4.0 : 2.0;
      sum += weight * duration_s / (6.0 * kPieces) * reach * reach.transpose();
    }
    const Matrix3 q = jerk_covariance(duration_s);
    EXPECT_LT((q - sum).cwiseQuotient(sum).cwiseAbs().maxCoeff(), 1e-9);
    // Two steps in a row are one of twice the time.
    Matrix3 f;
    f << 1.0, duration_s, 0.5 * duration_s * duration_s, 0.0, 1.0, duration_s, 0.0, 0.0, 1.0;
    const Matrix3 twice = jerk_covariance(2.0 * duration_s);
    EXPECT_LT((f * q * f.transpose() + q - twice).cwiseQuotient(twice).cwiseAbs().maxCoeff(),
              1e-12);
  }
}

}  // namespace
}  // namespace cdprcal::test
