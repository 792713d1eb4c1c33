// Transition and dwell times, judged by a simulation that shares none of their approximations.
#include "cdprcal/planning/timing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "../support/plan_robots.hpp"
#include "cdprcal/equilibria/direct.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal {
namespace {

TEST(FifthDegree, DerivativesAndInverse) {
  for (double x = 0.001; x < 1.0; x += 0.013) {
    const double h = 1e-5;
    EXPECT_NEAR(FifthDegree::value(x), fifth_degree(x), 1e-15);
    EXPECT_NEAR((FifthDegree::value(x + h) - FifthDegree::value(x - h)) / (2 * h),
                FifthDegree::velocity(x), 1e-8);
    EXPECT_NEAR((FifthDegree::velocity(x + h) - FifthDegree::velocity(x - h)) / (2 * h),
                FifthDegree::acceleration(x), 1e-7);
    EXPECT_NEAR(FifthDegree::inverse(FifthDegree::value(x)), x, 1e-9);
    EXPECT_LE(FifthDegree::velocity(x), 15.0 / 8.0);
  }
  EXPECT_EQ(FifthDegree::inverse(0.0), 0.0);
  EXPECT_EQ(FifthDegree::inverse(1.0), 1.0);
}

TEST(FifthDegree, ResidualBoundsWhatAnOscillatorDoes) {
  // After a transition an undamped oscillator rings with |∫ h′(x) e^{iωTx} dx|; both ends can help
  // each other, so the bound is twice what one end excites.
  double largest_ratio = 0.0;
  for (double omega_T = 4.0; omega_T < 200.0; omega_T *= 1.013) {
    std::complex<double> sum = 0.0;
    constexpr int kSteps = 4000;
    for (int i = 0; i < kSteps; ++i) {
      const double x = (i + 0.5) / kSteps;
      sum += FifthDegree::velocity(x) * std::exp(std::complex<double>(0.0, omega_T * x)) /
             static_cast<double>(kSteps);
    }
    const double ratio = std::abs(sum) / (2.0 * fifth_degree_residual(omega_T));
    EXPECT_LE(ratio, 1.0 + 1e-6) << omega_T;
    largest_ratio = std::max(largest_ratio, ratio);
  }
  EXPECT_GT(largest_ratio, 0.99);  // and is reached
}

/// Ringing [σ] right after the transition, and the most of it while measuring.
std::pair<double, double> simulate(const Robot& robot, const SetPoint& from, const SetPoint& to,
                                   const Timing& timing, double damping_ratio) {
  const test::Simulator simulator(robot, damping_ratio);
  const Matrix6 at_start = simulator.damping_at(from), at_end = simulator.damping_at(to);
  const auto share = [&](double t) {
    return FifthDegree::value(std::min(1.0, t / timing.transition_s));
  };
  const auto tension = [&](double t) -> CableVector {
    return from.tension_N + share(t) * (to.tension_N - from.tension_N);
  };
  test::Simulator::State state{from.pose, Vector6::Zero()};
  double after = 0.0, measuring = 0.0;
  constexpr double kStep_s = 0.004;
  const double period_s = 3.0;
  for (double t = 0.0; t < timing.transition_s + timing.dwell_s; t += kStep_s) {
    const Matrix6 damping = at_start + share(t) * (at_end - at_start);
    state = simulator.step(state, t, kStep_s, tension, damping);
    const double away = test::readings_away(robot, to, state.pose);
    if (t > timing.transition_s && t < timing.transition_s + period_s)
      after = std::max(after, away);
    if (t > timing.transition_s + timing.settling_s) measuring = std::max(measuring, away);
  }
  return {after, measuring};
}

TEST(Timing, ThePlatformRestsWhenMeasuringBegins) {
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver(robot);
  const PathChecker checker(solver);
  const auto points = test::set_points_in(solver, *published_measurement_box(robot), {2, 2, 2});
  ASSERT_EQ(points.size(), 8U);
  for (const double damping : {0.05, 0.1, 0.2}) {
    TimingOptions options;
    options.damping_ratio = damping;
    const TransitionTimer timer(checker, options);
    double most = 0.0;
    for (const auto& [a, b] : std::vector<std::pair<int, int>>{{0, 1}, {0, 4}, {7, 0}, {2, 6}}) {
      const auto timing = timer.time(checker.follow(points[a], points[b]));
      ASSERT_TRUE(timing);
      const auto [after, measuring] = simulate(robot, points[a], points[b], *timing, damping);
      EXPECT_LE(measuring, options.rest_tolerance) << a << " → " << b << ", ζ = " << damping;
      most = std::max(most, measuring);
      if (timing->settling_s > 3.0) {
        EXPECT_GT(after, options.rest_tolerance) << "waiting was not needed";
      }
    }
    EXPECT_GT(most, 0.2 * options.rest_tolerance) << "the waits are much longer than needed";
  }
}

TEST(Timing, KeepsTheSpeedLimits) {
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver(robot);
  const PathChecker checker(solver);
  const SetPoint a = *solver.at({0.4, 0.4, 1.2}).set_point;
  const SetPoint b = *solver.at({-0.4, -0.4, 0.6}).set_point;
  const Path path = checker.follow(a, b);
  const auto peak_speed = [&](double T) {
    // Of the equilibrium, by differences over a fine division of the duration.
    Pose pose = a.pose;
    double peak = 0.0;
    constexpr int kSteps = 400;
    for (int i = 1; i <= kSteps; ++i) {
      const double s = FifthDegree::value(static_cast<double>(i) / kSteps);
      const Pose next =
          direct_from_tensions(robot, a.tension_N + s * (b.tension_N - a.tension_N), pose).pose;
      peak = std::max(peak, (next.position_m - pose.position_m).norm() * kSteps / T);
      pose = next;
    }
    return peak;
  };
  TimingOptions slow;
  slow.max_platform_speed_m_s = 0.05;
  const auto limited = TransitionTimer(checker, slow).time(path);
  ASSERT_TRUE(limited);
  EXPECT_NEAR(peak_speed(limited->transition_s), 0.05, 0.003);
  slow.max_platform_speed_m_s = 0.5;
  slow.max_cable_speed_m_s = 0.05;
  EXPECT_GT(TransitionTimer(checker, slow).time(path)->transition_s, 20.0);
  const auto free = TransitionTimer(checker).time(path);
  EXPECT_LT(peak_speed(free->transition_s), 0.5);
}

TEST(Timing, NoTransitionOfAnotherDurationNeedsLess) {
  // Transition and settling together are the least over durations: a stricter speed limit, which
  // only takes durations away, never makes the sum smaller.
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver(robot);
  const PathChecker checker(solver);
  const Path path = checker.follow(*solver.at({0.4, 0.4, 1.2}).set_point,
                                   *solver.at({-0.4, -0.4, 0.6}).set_point);
  double before = 0.0;
  for (const double limit : {2.0, 0.5, 0.2, 0.15, 0.1, 0.08, 0.05}) {
    TimingOptions options;
    options.max_platform_speed_m_s = limit;
    const auto timing = TransitionTimer(checker, options).time(path);
    ASSERT_TRUE(timing);
    EXPECT_GE(timing->total_s(), before - 0.11) << limit;  // times are in tenths
    before = timing->total_s();
  }
}

TEST(Timing, LessDampingTakesLonger) {
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver(robot);
  const PathChecker checker(solver);
  const Path path = checker.follow(*solver.at({0.0, 0.0, 0.9}).set_point,
                                   *solver.at({-0.4, -0.4, 0.6}).set_point);
  double before = HUGE_VAL;
  for (const double damping : {0.01, 0.03, 0.1, 0.3, 0.7}) {
    TimingOptions options;
    options.damping_ratio = damping;
    const auto timing = TransitionTimer(checker, options).time(path);
    ASSERT_TRUE(timing);
    EXPECT_LE(timing->total_s(), before + 0.11);
    before = timing->total_s();
  }
}

TEST(Timing, APathAlongTheEdgeIsLengthenedUntilThePlatformStaysInside) {
  // The way across dips, and the faster it is taken the deeper the platform swings. Bounds just
  // below the lowest equilibrium leave little room for that.
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver(robot);
  const SetPoint a = *solver.at({-0.4, -0.4, 0.7}).set_point;
  const SetPoint b = *solver.at({0.4, 0.4, 0.7}).set_point;
  const Box wide{{-0.8, -0.8, 0.2}, {0.8, 0.8, 1.4}};
  const auto path_within = [&](const Box& bounds, double* transition_s) {
    PathOptions options;
    options.bounds = bounds;
    const PathChecker checker(solver, options);
    const Path path = checker.follow(a, b);
    const auto timing = TransitionTimer(checker).time(path);
    *transition_s = timing ? timing->transition_s : kNaN;
    return path;
  };
  double roomy = 0.0, tight = 0.0, none = 0.0;
  const Path path = path_within(wide, &roomy);
  ASSERT_TRUE(path.clear());
  double lowest = HUGE_VAL;
  for (const PathPoint& p : path.points) lowest = std::min(lowest, p.pose.position_m.z());
  ASSERT_LT(lowest, 0.69);
  Box close = wide;
  close.lower_m.z() = lowest - 0.1e-3;
  EXPECT_TRUE(path_within(close, &tight).clear());
  EXPECT_GT(tight, 1.3 * roomy);
  close.lower_m.z() = lowest - 1e-8;  // room for no swing at all
  EXPECT_TRUE(path_within(close, &none).clear());
  EXPECT_TRUE(std::isnan(none));
}

TEST(Timing, RefusesOptionsThatMakeNoSense) {
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver(robot);
  const PathChecker checker(solver);
  const auto refuses = [&](auto change) {
    TimingOptions options;
    change(options);
    EXPECT_THROW(TransitionTimer(checker, options), InputError);
  };
  refuses([](TimingOptions& o) { o.max_platform_speed_m_s = 0.0; });
  refuses([](TimingOptions& o) { o.max_cable_speed_m_s = -1.0; });
  refuses([](TimingOptions& o) { o.damping_ratio = 0.0; });
  refuses([](TimingOptions& o) { o.damping_ratio = 1.0; });
  refuses([](TimingOptions& o) { o.rest_tolerance = kNaN; });
  refuses([](TimingOptions& o) { o.measuring_s = -1.0; });
}

}  // namespace
}  // namespace cdprcal
