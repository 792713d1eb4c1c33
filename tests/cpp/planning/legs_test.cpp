// All ways between places: as long as their transitions, by way of others where no direct one is
// clear.
#include "cdprcal/planning/legs.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/plan_robots.hpp"

namespace cdprcal {
namespace {

using ::testing::HasSubstr;

SetPointOptions no_margin() {
  SetPointOptions options;
  options.tension_margin_N = 0.0;
  return options;
}

class Legs : public ::testing::Test {
 protected:
  const Robot robot = load_robot("irma4");
  const SetPointSolver solver{robot, no_margin()};
  const PathChecker checker{solver};
  const TransitionTimer timer{checker};
  [[nodiscard]] SetPoint at(double x, double y, double z) const {
    return *solver.at({x, y, z}).set_point;
  }
  /// Between these two the platform sags through the floor (path_test).
  const SetPoint low_a = at(-0.6, -0.66, 0.4375), low_b = at(0.6, 0.66, 0.1);
};

TEST_F(Legs, DirectOnesTakeWhatTheTimerSaysBothWays) {
  const std::vector<SetPoint> places{at(0.0, 0.0, 0.9), at(0.3, 0.2, 0.8), at(-0.3, 0.1, 1.1)};
  const LegTable legs(checker, timer, places, 1);
  EXPECT_EQ(legs.places().size(), 3U) << "none is added";
  const Eigen::MatrixXd time_s = legs.time_s();
  ASSERT_EQ(time_s.rows(), 3);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(time_s(i, i), 0.0);
    EXPECT_TRUE(legs.way(i, i).empty());
    for (int j = 0; j < 3; ++j) {
      if (i == j) continue;
      // The way back is the reverse of the way there, followed here from its own start.
      const Path path =
          checker.follow(places[static_cast<std::size_t>(i)], places[static_cast<std::size_t>(j)]);
      ASSERT_TRUE(path.clear());
      EXPECT_EQ(legs.obstacle(i, j), "");
      EXPECT_NEAR(time_s(i, j), timer.time(path)->total_s(), 0.02) << i << " to " << j;
      const std::vector<Leg> way = legs.way(i, j);
      ASSERT_EQ(way.size(), 1U);
      EXPECT_EQ(way[0].to, j);
      EXPECT_NEAR(way[0].timing.total_s(), time_s(i, j), 1e-12);
    }
  }
}

TEST_F(Legs, GoByWayOfAnotherPlaceAndMeasureOnlyAtTheEnd) {
  const LegTable legs(checker, timer, {at(0.0, 0.0, 0.9), low_a, low_b});
  EXPECT_EQ(legs.places().size(), 3U) << "the first is a way between the other two";
  EXPECT_THAT(legs.obstacle(1, 2), HasSubstr("bounds"));
  const std::vector<Leg> way = legs.way(1, 2);
  ASSERT_EQ(way.size(), 2U);
  EXPECT_EQ(way[0].to, 0);
  EXPECT_EQ(way[1].to, 2);
  EXPECT_NEAR(legs.time_s()(1, 2),
              way[0].timing.transition_s + way[0].timing.settling_s + way[1].timing.total_s(),
              1e-12);
  // A detour is the shortest there is: no other one is shorter.
  EXPECT_LE(legs.time_s()(1, 2), legs.time_s()(1, 0) + legs.time_s()(0, 2));
}

TEST_F(Legs, PlacesToPassThroughAreAddedWhereThoseGivenDoNotDo) {
  const LegTable legs(checker, timer, {low_a, low_b});
  ASSERT_GT(legs.places().size(), 2U);
  EXPECT_EQ(legs.time_s().rows(), 2) << "the places given";
  EXPECT_THAT(legs.obstacle(0, 1), HasSubstr("bounds"));
  const std::vector<Leg> way = legs.way(0, 1);
  ASSERT_GE(way.size(), 2U);
  EXPECT_EQ(way.back().to, 1);
  double time_s = 0.0;
  std::size_t from = 0;
  for (const Leg& leg : way) {
    const auto to = static_cast<std::size_t>(leg.to);
    if (to != 1U) {
      EXPECT_GE(to, 2U);
      for (int axis = 0; axis < 3; ++axis) {  // around the places
        const double a = low_a.pose.position_m[axis], b = low_b.pose.position_m[axis];
        const double x = legs.places()[to].pose.position_m[axis];
        EXPECT_GE(x, std::min(a, b) - 1e-9);
        EXPECT_LE(x, std::max(a, b) + 1e-9);
      }
    }
    EXPECT_TRUE(checker.follow(legs.places()[from], legs.places()[to]).clear());
    time_s += leg.timing.transition_s + leg.timing.settling_s;
    from = to;
  }
  time_s += way.back().timing.dwell_s - way.back().timing.settling_s;
  EXPECT_NEAR(legs.time_s()(0, 1), time_s, 1e-12);
}

TEST_F(Legs, ToAPlaceWhereNothingRestsThereAreNone) {
  SetPoint nowhere = at(0.2, 0.0, 0.9);
  nowhere.tension_N.setConstant(robot.tension_max_N);  // pulls the platform away
  const LegTable legs(checker, timer, {at(0.0, 0.0, 0.9), at(0.1, 0.1, 0.8), nowhere});
  const Eigen::MatrixXd time_s = legs.time_s();
  for (const int i : {0, 1}) {
    EXPECT_TRUE(std::isinf(time_s(i, 2)));
    EXPECT_TRUE(std::isinf(time_s(2, i)));
    EXPECT_TRUE(legs.way(i, 2).empty());
    EXPECT_FALSE(legs.obstacle(i, 2).empty());
  }
  EXPECT_TRUE(std::isfinite(time_s(0, 1)));
}

TEST_F(Legs, AlongTheEdgeThatNoDurationKeepsThePlatformInsideAreNone) {
  const SetPoint from = at(-0.3, 0.0, 0.9), to = at(0.3, 0.0, 0.9);
  const Path wide = checker.follow(from, to);
  ASSERT_TRUE(wide.clear());
  // A floor exactly as low as the path: it is clear, and the least lag goes through it.
  PathOptions options;
  options.bounds = workspace_box(robot);
  options.bounds->lower_m.z() = HUGE_VAL;
  for (const PathPoint& point : wide.points) {
    options.bounds->lower_m.z() =
        std::min(options.bounds->lower_m.z(), point.pose.position_m.z() - 1e-12);
  }
  const PathChecker tight(solver, options);
  ASSERT_TRUE(tight.follow(from, to).clear());
  const TransitionTimer tight_timer(tight);
  ASSERT_FALSE(tight_timer.time(tight.follow(from, to)));
  const LegTable legs(tight, tight_timer, {from, to});
  EXPECT_THAT(legs.obstacle(0, 1), HasSubstr("no duration keeps the platform inside"));
}

TEST_F(Legs, OfOnePlaceOrNoneAreNone) {
  EXPECT_EQ(LegTable(checker, timer, {}).time_s().size(), 0);
  const LegTable one(checker, timer, {low_a});
  EXPECT_EQ(one.time_s(), Eigen::MatrixXd::Zero(1, 1));
  EXPECT_EQ(one.places().size(), 1U);
}

TEST_F(Legs, StopWhenAsked) {
  const LegTable legs(checker, timer, {low_a, low_b}, 1, [](double) { return false; });
  EXPECT_TRUE(legs.stopped());
  const LegTable whole(checker, timer, {low_a, low_b}, 1, [](double share) {
    EXPECT_GE(share, 0.0);
    EXPECT_LE(share, 1.0);
    return true;
  });
  EXPECT_FALSE(whole.stopped());
}

}  // namespace
}  // namespace cdprcal
