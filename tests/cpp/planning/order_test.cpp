// Visiting orders: the shortest by brute force, the known shortest, and random ones.
#include "cdprcal/planning/order.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <set>

#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

Eigen::MatrixXd random_times(std::mt19937_64& rng, int poses) {
  std::uniform_real_distribution<double> time(1.0, 20.0);
  return Eigen::MatrixXd::NullaryExpr(poses + 1, poses + 1, [&] { return time(rng); });
}

double length_of(const Eigen::MatrixXd& time_s, const std::vector<int>& order) {
  double sum = 0.0;
  int at = 0;
  for (const int pose : order) {
    sum += time_s(at, pose + 1);
    at = pose + 1;
  }
  return sum;
}

double brute_force(const Eigen::MatrixXd& time_s) {
  std::vector<int> order(time_s.rows() - 1);
  std::iota(order.begin(), order.end(), 0);
  double best = std::numeric_limits<double>::infinity();
  do {
    best = std::min(best, length_of(time_s, order));
  } while (std::next_permutation(order.begin(), order.end()));
  return best;
}

bool visits_all_once(const std::vector<int>& order, int poses) {
  std::vector<int> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  std::vector<int> all(poses);
  std::iota(all.begin(), all.end(), 0);
  return sorted == all;
}

TEST(LeastTimeTour, IsTheShortestByBruteForce) {
  std::mt19937_64 rng(1);
  for (int poses = 1; poses <= 8; ++poses) {
    for (int trial = 0; trial < (poses < 8 ? 20 : 3); ++trial) {
      const Eigen::MatrixXd time_s = random_times(rng, poses);  // not symmetric
      const Tour tour = least_time_tour(time_s);
      EXPECT_TRUE(tour.optimal);
      EXPECT_TRUE(visits_all_once(tour.order, poses));
      EXPECT_NEAR(tour.time_s, brute_force(time_s), 1e-9);
      EXPECT_NEAR(tour.time_s, length_of(time_s, tour.order), 1e-9);
    }
  }
}

TEST(LeastTimeTour, OfManyPosesOnALineIsTheLine) {
  std::mt19937_64 rng(2);
  constexpr int kPoses = 40;
  std::vector<int> place(kPoses);
  std::iota(place.begin(), place.end(), 1);
  std::shuffle(place.begin(), place.end(), rng);
  place.insert(place.begin(), 0);
  const Eigen::MatrixXd time_s = Eigen::MatrixXd::NullaryExpr(
      kPoses + 1, kPoses + 1,
      [&](Eigen::Index i, Eigen::Index j) { return std::abs(place[i] - place[j]); });
  const Tour tour = least_time_tour(time_s);
  EXPECT_FALSE(tour.optimal);
  EXPECT_TRUE(visits_all_once(tour.order, kPoses));
  EXPECT_NEAR(tour.time_s, kPoses, 1e-9);
}

TEST(LeastTimeTour, OfManyRandomPosesIsNearTheBestOfManyRestarts) {
  // Random points in a square; a tour of n points is about 0.7124 √(nA) long (Beardwood et al.),
  // and 2-opt with or-opt is known to come within some percent of the best.
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  constexpr int kPoses = 120;
  Eigen::MatrixX2d at(kPoses + 1, 2);
  for (double& v : at.reshaped()) v = unit(rng);
  const Eigen::MatrixXd time_s = Eigen::MatrixXd::NullaryExpr(
      kPoses + 1, kPoses + 1,
      [&](Eigen::Index i, Eigen::Index j) { return (at.row(i) - at.row(j)).norm(); });
  const Tour tour = least_time_tour(time_s);
  EXPECT_TRUE(visits_all_once(tour.order, kPoses));
  EXPECT_NEAR(tour.time_s, length_of(time_s, tour.order), 1e-9);
  EXPECT_LT(tour.time_s, 1.10 * 0.7124 * std::sqrt(1.0 * kPoses) + 0.7);
  EXPECT_EQ(least_time_tour(time_s).order, tour.order) << "the same input, the same tour";
  // Nothing left for 2-opt.
  for (std::size_t i = 0; i < tour.order.size(); ++i) {
    for (std::size_t j = i + 1; j < tour.order.size(); ++j) {
      std::vector<int> other = tour.order;
      std::reverse(other.begin() + static_cast<std::ptrdiff_t>(i),
                   other.begin() + static_cast<std::ptrdiff_t>(j) + 1);
      EXPECT_GE(length_of(time_s, other), tour.time_s - 1e-9);
    }
  }
}

TEST(LeastTimeTour, GoesAroundWaysThatDoNotExist) {
  const double none = std::numeric_limits<double>::infinity();
  for (const int poses : {6, 20}) {
    // Only p → p + 1 and back exist.
    const Eigen::MatrixXd time_s = Eigen::MatrixXd::NullaryExpr(
        poses + 1, poses + 1,
        [&](Eigen::Index i, Eigen::Index j) { return std::abs(i - j) == 1 ? 1.0 : none; });
    const Tour tour = least_time_tour(time_s);
    EXPECT_NEAR(tour.time_s, poses, 1e-9);
    Eigen::MatrixXd cut = time_s;
    cut.row(poses).setConstant(none);
    cut.col(poses).setConstant(none);
    EXPECT_EQ(least_time_tour(cut).time_s, none);
  }
}

TEST(LeastTimeTour, RefusesWhatIsNoMatrixOfTimes) {
  EXPECT_THROW((void)least_time_tour(Eigen::MatrixXd::Zero(2, 3)), InputError);
  EXPECT_THROW((void)least_time_tour(Eigen::MatrixXd::Constant(3, 3, std::nan(""))), InputError);
  EXPECT_TRUE(least_time_tour(Eigen::MatrixXd::Zero(1, 1)).order.empty());
}

Eigen::MatrixXd random_lengths(std::mt19937_64& rng, int poses, int cables) {
  std::uniform_real_distribution<double> length(1.0, 3.0);
  return Eigen::MatrixXd::NullaryExpr(poses + 1, cables, [&] { return length(rng); });
}

TEST(RandomOrder, VisitsEachPoseOnceARoundAndNeverTwiceInARow) {
  std::mt19937_64 rng(4);
  for (const int poses : {2, 3, 8, 27}) {
    for (const int visits : {1, 2, 3}) {
      const Eigen::MatrixXd lengths = random_lengths(rng, poses, 4);
      const std::vector<int> order = random_order(lengths, visits, 7);
      ASSERT_EQ(order.size(), static_cast<std::size_t>(poses * visits));
      for (int v = 0; v < visits; ++v) {
        EXPECT_TRUE(
            visits_all_once({order.begin() + v * poses, order.begin() + (v + 1) * poses}, poses));
      }
      EXPECT_EQ(std::adjacent_find(order.begin(), order.end()), order.end());
    }
  }
}

TEST(RandomOrder, DependsOnTheSeedAlone) {
  std::mt19937_64 rng(5);
  const Eigen::MatrixXd lengths = random_lengths(rng, 12, 4);
  std::set<std::vector<int>> different;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const auto order = random_order(lengths, 2, seed);
    EXPECT_EQ(order, random_order(lengths, 2, seed));
    different.insert(order);
  }
  EXPECT_EQ(different.size(), 20U);
}

TEST(RandomOrder, ReachesPosesBothWaysFarMoreOftenThanChance) {
  std::mt19937_64 rng(6);
  double sought = 0.0, by_chance = 0.0;
  for (int trial = 0; trial < 10; ++trial) {
    const Eigen::MatrixXd lengths = random_lengths(rng, 10, 4);
    const ApproachCoverage found = approach_coverage(lengths, random_order(lengths, 2, trial));
    EXPECT_LE(found.both, found.possible);
    sought += static_cast<double>(found.both) / found.possible;
    std::vector<int> order(20);
    for (int i = 0; i < 20; ++i) order[i] = i % 10;
    std::shuffle(order.begin(), order.end(), rng);
    by_chance += static_cast<double>(approach_coverage(lengths, order).both) / found.possible;
  }
  EXPECT_GT(sought / 10.0, 0.7);
  EXPECT_LT(by_chance / 10.0, 0.5);
}

TEST(RandomOrder, CountsDirectionsOfApproach) {
  // One cable; lengths 1, 2, 3 m; the start at 0. Pose 1 (2 m) is reached paying out from pose 0
  // and reeling in from pose 2; poses 0 and 2 are the ends, and pose 0 is not the shortest place
  // but the shortest pose: it can only be reached reeling in.
  const Eigen::MatrixXd lengths = (Eigen::MatrixXd(4, 1) << 0.0, 1.0, 2.0, 3.0).finished();
  const ApproachCoverage both = approach_coverage(lengths, {0, 1, 2, 1});
  EXPECT_EQ(both.possible, 1);
  EXPECT_EQ(both.both, 1);
  EXPECT_EQ(approach_coverage(lengths, {0, 1, 2}).both, 0);
}

TEST(RandomOrder, RefusesVisitsThatCannotBe) {
  std::mt19937_64 rng(7);
  EXPECT_THROW((void)random_order(random_lengths(rng, 3, 4), 0, 1), InputError);
  EXPECT_THROW((void)random_order(random_lengths(rng, 0, 4), 1, 1), InputError);
  EXPECT_THROW((void)random_order(random_lengths(rng, 1, 4), 2, 1), InputError);
  EXPECT_EQ(random_order(random_lengths(rng, 1, 4), 1, 1), std::vector<int>{0});
}

TEST(VisitingOrder, NamesRoundTrip) {
  for (const auto order : {VisitingOrder::least_time, VisitingOrder::random}) {
    EXPECT_EQ(parse_visiting_order(to_string(order)), order);
  }
  EXPECT_THROW((void)parse_visiting_order("shortest"), InputError);
}

}  // namespace
}  // namespace cdprcal
