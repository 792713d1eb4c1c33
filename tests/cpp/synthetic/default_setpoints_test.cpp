// Set-points and starts that nobody chose: in the box, in balance, reachable.
#include <gmock/gmock.h>

#include "../support/random_robot.hpp"
#include "../support/startup_scenario.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/simulator/random_start.hpp"
#include "cdprcal/startup/path_model.hpp"

namespace cdprcal::test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

TEST(DefaultSetpoints, AreAGridWalkedFromNeighbourToNeighbour) {
  const std::vector<std::array<int, 3>> grids{{3, 2, 2}, {2, 3, 2}, {3, 3, 1}, {1, 2, 3}};
  for (const auto& [nx, ny, nz] : grids) {
    SCOPED_TRACE(std::to_string(nx) + " x " + std::to_string(ny) + " x " + std::to_string(nz));
    const Robot robot = load_robot("irma4");
    const auto setpoints = default_setpoints(robot, nx, ny, nz);
    ASSERT_EQ(setpoints.size(), static_cast<std::size_t>(nx * ny * nz));
    std::vector<Vector3> at;
    for (const CableVector& tension : setpoints) {
      EXPECT_GE(tension.minCoeff(), robot.tension_min_N);
      EXPECT_LE(tension.maxCoeff(), robot.tension_max_N);
      const EquilibriumResult rest = direct_from_tensions(robot, tension);
      ASSERT_EQ(rest.status, EquilibriumStatus::found) << rest.reason;
      at.push_back(rest.pose.position_m);
    }
    // One step of the grid each, along one axis, and every point once.
    Vector3 lower = at[0], upper = at[0];
    for (const Vector3& p : at) {
      lower = lower.cwiseMin(p);
      upper = upper.cwiseMax(p);
    }
    const std::array<int, 3> counts{nx, ny, nz};
    for (std::size_t i = 0; i < at.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) EXPECT_GT((at[i] - at[j]).norm(), 0.01);
      if (i == 0) continue;
      int moved = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const double move = std::abs(at[i][axis] - at[i - 1][axis]);
        if (move < 1e-6) continue;
        ++moved;
        EXPECT_NEAR(move, (upper - lower)[axis] / (counts[axis] - 1), 1e-6);
      }
      EXPECT_EQ(moved, 1) << i;
    }
    EXPECT_NEAR(at[0].z(), upper.z(), 1e-6) << "from the top";
  }
}

TEST(DefaultSetpoints, OfOtherRobotsCanBeVisitedUnderForceControl) {
  for (const int cables : {3, 5}) {
    const Robot robot = ring_robot(cables);
    const auto setpoints = default_setpoints(robot, 2, 2, 2);
    ASSERT_EQ(setpoints.size(), 8U);
    std::optional<Pose> at;
    for (std::size_t i = 1; i < setpoints.size(); ++i) {
      const PathResult path = follow_equilibrium(robot, setpoints[i - 1], setpoints[i], at);
      ASSERT_TRUE(path.found) << path.reason;
      at = path.leg.nodes.back().pose;
      EXPECT_LT(minus(*at, direct_from_tensions(robot, setpoints[i]).pose).norm(), 1e-6);
    }
  }
}

TEST(DefaultSetpoints, RefuseAGridThatIsNoneAndARobotThatHasNone) {
  const Robot robot = load_robot("irma4");
  const std::vector<std::pair<std::array<int, 3>, std::string>> grids{
      {{0, 2, 2}, "0"}, {{2, -1, 2}, "-1"}, {{2, 2, 100}, "100"}};
  for (const auto& grid : grids) {
    const auto& counts = grid.first;
    EXPECT_THAT(([&] { (void)default_setpoints(robot, counts[0], counts[1], counts[2]); }),
                ThrowsMessage<InputError>(
                    HasSubstr("1 to 99 points in each direction, not " + grid.second)));
  }
  Robot weak = robot;
  weak.tension_max_N = 25.0;  // four times less than the platform weighs
  finalise(weak);
  EXPECT_THAT([&] { (void)default_setpoints(weak, 2, 2, 2); },
              ThrowsMessage<InputError>(HasSubstr("no grid of stable equilibria")));
}

TEST(RandomStart, HangsSomewhereInTheBoxAndTheSameForTheSameSeed) {
  const Robot robot = load_robot("irma4");
  const Box box{{-0.4, -0.3, 0.6}, {0.4, 0.2, 1.2}};
  Vector3 sum = Vector3::Zero();
  constexpr int kSeeds = 60;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const auto start = random_start(robot, box, seed);
    ASSERT_TRUE(start);
    EXPECT_TRUE(box.contains(start->pose.position_m, 1e-9));
    EXPECT_GE(tension_margin_N(robot, start->tension_N), 0.0);
    const EquilibriumResult rest = direct_from_tensions(robot, start->tension_N, start->pose);
    ASSERT_EQ(rest.status, EquilibriumStatus::found) << "stable at constant tensions";
    EXPECT_LT(minus(rest.pose, start->pose).norm(), 1e-6);
    EXPECT_EQ(random_start(robot, box, seed)->tension_N, start->tension_N);
    sum += start->pose.position_m;
  }
  // Every position of this box is one, so they are spread evenly: within four standard errors.
  const Vector3 middle = 0.5 * (box.lower_m + box.upper_m), size = box.upper_m - box.lower_m;
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(sum[axis] / kSeeds, middle[axis], 4.0 * size[axis] / std::sqrt(12.0 * kSeeds));
  }
}

TEST(RandomStart, IsNothingWhereNothingHangs) {
  const Robot robot = load_robot("irma4");
  const Box above{{-0.1, -0.1, 1.7}, {0.1, 0.1, 1.8}};
  EXPECT_FALSE(random_start(robot, above, 1, 5));
  EXPECT_FALSE(random_start(robot, {{-0.1, -0.1, 0.8}, {0.1, 0.1, 0.9}}, 1, 0)) << "no tries";
  Rng rng(1);
  EXPECT_THROW((void)random_start(random_robot(rng, 2), above, 1), InputError);
}

}  // namespace
}  // namespace cdprcal::test
