// How long a cable that sags is: by the catenary itself.
#include <gtest/gtest.h>

#include <boost/math/tools/toms748_solve.hpp>

#include "../support/random_measurement.hpp"
#include "cdprcal/effects/catalogue.hpp"

namespace cdprcal::test {
namespace {

/// By how much an inextensible cable of this weight [N/m] is longer than its chord [m], which ends
/// so far away and so much lower than where it is pulled [m].
double catenary_excess_m(double weight_N_m, double away_m, double down_m, double tension_N) {
  const auto arc_m = [&](double a_m) {
    return std::hypot(down_m, 2.0 * a_m * std::sinh(away_m / (2.0 * a_m)));
  };
  // Tensions at the ends: their difference is the weight of the height, their sum that of the arc.
  const auto too_taut = [&](double log_a) {
    const double a_m = std::exp(log_a);
    return 0.5 * weight_N_m * (arc_m(a_m) / std::tanh(away_m / (2.0 * a_m)) + down_m) - tension_N;
  };
  std::uintmax_t steps = 200;
  const auto [low, high] =
      boost::math::tools::toms748_solve(too_taut, std::log(0.5 * away_m), std::log(1e4 * away_m),
                                        boost::math::tools::eps_tolerance<double>(48), steps);
  return arc_m(std::exp(0.5 * (low + high))) - std::hypot(away_m, down_m);
}

TEST(CableSag, IsAsLongAsACatenary) {
  const auto sag = find_effect("cable_sag");
  Rng rng(11);
  int compared = 0;
  for (const RobotPose& at : derivative_cases()) {
    SCOPED_TRACE(at.label);
    const PlatformState state = platform_state(at.robot, at.pose);
    if (!state.valid) continue;
    Measurement m = random_measurement(rng, at);
    const double density_kg_m = uniform(rng, 0.01, 0.3);
    const double weight_N_m = density_kg_m * at.robot.gravity_m_s2;
    for (int i = 0; i < state.cable_count; ++i) {  // slack ones, too: it pulls 4 to 60 times itself
      m.tension_N[i] = uniform(rng, 4.0, 60.0) * weight_N_m * state.cable[i].free_length_m;
    }
    PoseEvaluation without, with;
    evaluate_pose(at.robot, m, at.pose, StaticsModel::wrench, {}, {}, true, without);
    const ActiveEffect active{sag, EffectValues::Constant(1, density_kg_m)};
    evaluate_pose(at.robot, m, at.pose, StaticsModel::wrench, {}, {active}, true, with);
    ASSERT_TRUE(with.valid);
    for (int i = 0; i < state.cable_count; ++i) {
      const CableState& cable = state.cable[i];
      const double away_m = cable.free_length_m * cable.direction.head<2>().norm();
      if (away_m < 0.05 * cable.free_length_m) continue;  // it hangs straight down
      const double expected_m = catenary_excess_m(
          weight_N_m, away_m, -cable.free_length_m * cable.direction.z(), m.tension_N[i]);
      EXPECT_NEAR(with.length_m[i] - without.length_m[i], expected_m, 0.03 * expected_m + 1e-9);
      ++compared;
    }
  }
  EXPECT_GT(compared, 50);
}

}  // namespace
}  // namespace cdprcal::test
