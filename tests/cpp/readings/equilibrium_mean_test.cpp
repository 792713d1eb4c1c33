// The mean of a rest and how certain it is.
#include "cdprcal/readings/equilibrium_mean.hpp"

#include <gtest/gtest.h>

#include "cdprcal/error.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal::test {
namespace {

/// One cable at rest: a length with white noise, a tension with noise of correlation `rho`.
Log resting(Eigen::Index samples, double rho, RandomNormal& random) {
  Log log;
  log.source = "run.csv";
  log.time_s = Eigen::VectorXd::LinSpaced(samples, 0.0, 0.1 * static_cast<double>(samples - 1));
  log.length_m.resize(samples, 1);
  log.tension_N.resize(samples, 1);
  log.swivel_rad.resize(samples, 0);
  log.tension_setpoint_N.resize(samples, 0);
  log.roll_pitch_yaw_rad.resize(samples, 3);
  double noise = random();
  for (Eigen::Index i = 0; i < samples; ++i) {
    log.length_m(i, 0) = 1e3 + 2e-3 * random();
    noise = rho * noise + std::sqrt(1.0 - rho * rho) * random();
    log.tension_N(i, 0) = 80.0 + 0.5 * noise;
    // Yaw across the seam; pitch absent.
    log.roll_pitch_yaw_rad.row(i) << 0.1 + 1e-3 * random(), kNaN, wrap_angle(kPi + 0.01 * random());
  }
  return log;
}

TEST(EquilibriumMean, IsTheMeanWithTheCovarianceOfTheMean) {
  RandomNormal random(4);
  constexpr Eigen::Index kSamples = 400;
  const Log log = resting(kSamples, 0.0, random);
  const EquilibriumMean rest = equilibrium_mean(log, {0, kSamples});
  ASSERT_EQ(rest.mean.size(), 5);  // length, tension, roll, pitch, yaw
  EXPECT_NEAR(rest.mean[0], log.length_m.mean(), 1e-12);
  EXPECT_NEAR(rest.mean[1], log.tension_N.mean(), 1e-12);
  EXPECT_TRUE(std::isnan(rest.mean[3]));
  EXPECT_NEAR(std::abs(wrap_angle(rest.mean[4] - kPi)), 0.0, 5.0 * 0.01 / std::sqrt(kSamples));
  EXPECT_NEAR(std::sqrt(rest.covariance(0, 0)), 2e-3 / std::sqrt(kSamples), 2e-5);
  EXPECT_NEAR(std::sqrt(rest.covariance(4, 4)), 0.01 / std::sqrt(kSamples), 1e-4);
  EXPECT_LT(std::abs(rest.covariance(0, 1)),
            0.2 * std::sqrt(rest.covariance(0, 0) * rest.covariance(1, 1)));
  EXPECT_GT(rest.effective_samples[0], 0.6 * kSamples);
}

TEST(EquilibriumMean, CorrelatedReadingsCountAsWhatTheyAre) {
  // The deviation that is claimed against the one that many rests show.
  RandomNormal random(8);
  for (const double rho : {0.0, 0.7, 0.95}) {
    SCOPED_TRACE(rho);
    constexpr int kRests = 400;
    constexpr Eigen::Index kSamples = 200;
    double squares = 0.0, claimed = 0.0;
    for (int k = 0; k < kRests; ++k) {
      const EquilibriumMean rest = equilibrium_mean(resting(kSamples, rho, random), {0, kSamples});
      squares += std::pow(rest.mean[1] - 80.0, 2);
      claimed += rest.covariance(1, 1);
    }
    EXPECT_NEAR(std::sqrt(claimed / squares), 1.0, 0.2);
  }
}

TEST(EquilibriumMean, PassesOverWhatIsAbsent) {
  RandomNormal random(1);
  Log log = resting(10, 0.0, random);
  log.length_m(3, 0) = kNaN;
  const EquilibriumMean rest = equilibrium_mean(log, {2, 5});
  EXPECT_NEAR(rest.mean[0], 0.5 * (log.length_m(2, 0) + log.length_m(4, 0)), 1e-12);
  const EquilibriumMean one = equilibrium_mean(log, {4, 5});
  EXPECT_EQ(one.mean[0], log.length_m(4, 0));
  EXPECT_EQ(one.covariance(0, 0), 0.0);
  EXPECT_EQ(one.effective_samples[0], 1.0);
  EXPECT_THROW(equilibrium_mean(log, {4, 4}), InputError);
  EXPECT_THROW(equilibrium_mean(log, {4, 11}), InputError);
  EXPECT_THROW(equilibrium_mean(log, {-1, 3}), InputError);
}

}  // namespace
}  // namespace cdprcal::test
