#include "cdprcal/startup/rest_detector.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal {
namespace {

constexpr double kPeriod_s = 0.01;

/// A platform that comes to rest, sampled at a clock whose stamps are `clock(k)`: what is judged
/// at every sample.
template <class Clock>
std::vector<double> ripples(const Clock& clock) {
  const Robot robot = load_robot("irma4");
  RestDetector detector(4, robot.sigma);
  std::mt19937_64 random(11);
  std::normal_distribution<double> noise;
  std::vector<double> out;
  for (int k = 0; k < 600; ++k) {
    const double swing = 0.01 * std::exp(-0.02 * k) * std::cos(0.3 * k);
    RobotSample sample;
    sample.time_s = clock(k);
    const auto noisy = [&](double value, double sigma) {
      CableVector v(4);
      for (double& x : v) x = value + swing + sigma * noise(random);
      return v;
    };
    sample.length_m = noisy(2.0, 1e-4);
    sample.swivel_rad = noisy(0.1, 1e-4);
    sample.tension_N = noisy(100.0, 0.1);
    for (double& angle : sample.roll_pitch_yaw_rad) angle = swing + 1e-3 * noise(random);
    detector.push(sample);
    const bool rests = detector.at_rest();
    EXPECT_EQ(rests, detector.ripple() <= 1.0) << k;
    out.push_back(detector.ripple());
  }
  return out;
}

TEST(RestDetector, DoesNotHangOnTheLastBitOfTheStamps) {
  const auto exact = ripples([](int k) { return k * kPeriod_s; });
  ASSERT_GT(*std::max_element(exact.begin() + 100, exact.end()), 1.0);
  ASSERT_LT(*std::min_element(exact.begin() + 100, exact.end()), 1.0);
  const double infinity = std::numeric_limits<double>::infinity();
  double sum = 0.0;
  std::vector<std::vector<double>> others;
  others.push_back(ripples([&](int k) { return k == 0 ? 0.0 : sum += kPeriod_s; }));
  others.push_back(ripples(
      [&](int k) { return std::nextafter(k * kPeriod_s, k % 3 == 0 ? infinity : -infinity); }));
  others.push_back(ripples([](int k) { return std::round(1e9 * k * kPeriod_s) / 1e9; }));
  for (const std::vector<double>& other : others) {
    for (std::size_t k = 0; k < exact.size(); ++k) {
      if (std::isnan(exact[k])) {
        EXPECT_TRUE(std::isnan(other[k])) << k;
      } else {
        EXPECT_NEAR(other[k], exact[k], 1e-6 * exact[k]) << k;
      }
    }
  }
}

}  // namespace
}  // namespace cdprcal
