// Which rows of a log hold a fresh reading.
#include "cdprcal/readings/fresh.hpp"

#include <gtest/gtest.h>

#include <random>

namespace cdprcal::test {
namespace {

/// A sensor of `columns` that reads in the rows given, and is held between them.
LogMatrix held(const std::vector<Eigen::Index>& rows, Eigen::Index all, int columns,
               unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  LogMatrix out = LogMatrix::Zero(all, columns);
  std::size_t next = 0;
  for (Eigen::Index row = 0; row < all; ++row) {
    const bool reads = next < rows.size() && rows[next] == row;
    if (row > 0) out.row(row) = out.row(row - 1);
    if (!reads) continue;
    ++next;
    for (int c = 0; c < columns; ++c) out(row, c) = normal(random);
  }
  return out;
}

std::vector<Eigen::Index> every(Eigen::Index hold, Eigen::Index all, Eigen::Index jitter = 0) {
  std::mt19937 random(5);
  std::uniform_int_distribution<Eigen::Index> off(-jitter, jitter);
  std::vector<Eigen::Index> out{0};
  while (out.back() + hold + jitter < all) out.push_back(out.back() + hold + off(random));
  return out;
}

TEST(FreshRows, AreThoseOfTheSensorWhateverItsRate) {
  for (const Eigen::Index hold : {1, 2, 3, 5, 20}) {
    for (const int columns : {1, 3, 8}) {
      const auto rows = every(hold, 600);
      const FreshRows found = fresh_rows(held(rows, 600, columns, 3), {0, 600});
      EXPECT_EQ(found.hold_rows, static_cast<double>(hold));
      EXPECT_EQ(found.rows, rows) << hold << " " << columns;
      EXPECT_EQ(found.are_all(), hold == 1);
    }
  }
}

TEST(FreshRows, MayComeALittleEarlyOrLate) {
  const auto rows = every(5, 1000, 1);
  const FreshRows found = fresh_rows(held(rows, 1000, 4, 3), {0, 1000});
  EXPECT_EQ(found.hold_rows, 5.0);
  EXPECT_EQ(found.rows, rows);
}

TEST(FreshRows, WithinARangeCountFromItsBeginning) {
  const FreshRows found = fresh_rows(held(every(5, 500), 500, 4, 3), {103, 400});
  EXPECT_EQ(found.hold_rows, 5.0);
  EXPECT_EQ(found.rows[0], 103);
  EXPECT_EQ(found.rows[1], 105);
  EXPECT_LT(found.rows.back(), 400);
}

TEST(FreshRows, AreThoseWithAReadingWhereTheOthersAreEmpty) {
  const auto rows = every(4, 400);
  LogMatrix readings = LogMatrix::Constant(400, 2, kNaN);
  double value = 0.0;
  for (const Eigen::Index row : rows) readings.row(row).setConstant(value += 0.1);
  const FreshRows found = fresh_rows(readings, {0, 400});
  EXPECT_EQ(found.hold_rows, 4.0);
  EXPECT_EQ(found.rows, rows);
  EXPECT_TRUE(fresh_rows(LogMatrix::Constant(400, 2, kNaN), {0, 400}).are_all());
  EXPECT_TRUE(fresh_rows(LogMatrix(400, 0), {0, 400}).are_all());
}

TEST(FreshRows, OfACoarseSensorAreAllThatWereDue) {
  // It repeats itself at rest, and reads anew in every row while the platform moves.
  LogMatrix coarse(600, 3);
  for (Eigen::Index row = 0; row < 600; ++row) {
    const double moved = row < 300 ? 0.0 : 1.3 * static_cast<double>(row - 300);
    coarse.row(row).setConstant(std::round(moved));
  }
  EXPECT_TRUE(fresh_rows(coarse, {0, 600}).are_all());
  // Held as well, it is taken to have read the same again.
  LogMatrix both(600, 3);
  for (Eigen::Index row = 0; row < 600; ++row) both.row(row) = coarse.row(row / 5 * 5);
  const FreshRows found = fresh_rows(both, {0, 600});
  EXPECT_EQ(found.hold_rows, 5.0);
  EXPECT_EQ(found.rows.size(), 120U);
}

TEST(WithoutHolds, MovesEvenlyFromOneReadingToTheNext) {
  Log log;
  log.time_s = Eigen::VectorXd::LinSpaced(200, 0.0, 3.98);
  log.length_m.resize(200, 2);
  log.roll_pitch_yaw_rad.resize(200, 3);
  const auto length = [](double t) { return 1.0 + 0.3 * t; };
  const auto yaw = [](double t) { return wrap_angle(3.0 + 0.5 * t); };
  for (Eigen::Index row = 0; row < 200; ++row) {
    log.length_m.row(row).setConstant(length(log.time_s[row]));
    log.roll_pitch_yaw_rad.row(row).setConstant(yaw(log.time_s[row / 5 * 5]));
  }
  const std::optional<Log> out = without_holds(log);
  ASSERT_TRUE(out.has_value());
  EXPECT_EQ(out->length_m, log.length_m);  // read anew in every row
  for (Eigen::Index row = 0; row < 195; ++row) {
    EXPECT_NEAR(wrap_angle(out->roll_pitch_yaw_rad(row, 2) - yaw(log.time_s[row])), 0.0, 1e-12);
  }
  log.roll_pitch_yaw_rad.resize(200, 0);
  EXPECT_FALSE(without_holds(log).has_value());
}

TEST(WithoutHolds, FollowsASwingThatIsReadEightTimesInAPeriod) {
  Log log;
  log.time_s = Eigen::VectorXd::LinSpaced(200, 0.0, 3.98);
  log.roll_pitch_yaw_rad.resize(200, 3);
  const auto roll = [](double t) { return 0.3 * std::sin(2.0 * kPi * 1.25 * t); };
  for (Eigen::Index row = 0; row < 200; ++row) {
    log.roll_pitch_yaw_rad.row(row).setConstant(roll(log.time_s[row / 5 * 5]));
  }
  const std::optional<Log> out = without_holds(log);
  ASSERT_TRUE(out.has_value());
  for (Eigen::Index row = 5; row < 190; ++row) {  // straight lines are 0.023 off
    EXPECT_NEAR(out->roll_pitch_yaw_rad(row, 0), roll(log.time_s[row]), 0.0045) << row;
  }
}

TEST(RowsReadAnew, AreThoseOfTheSensorThatIsHeldLongest) {
  Log log;
  log.time_s = Eigen::VectorXd::LinSpaced(200, 0.0, 3.98);
  log.length_m.resize(200, 2);
  log.swivel_rad.resize(200, 2);
  log.roll_pitch_yaw_rad.resize(200, 3);
  for (Eigen::Index row = 0; row < 200; ++row) {
    log.length_m.row(row).setConstant(std::sin(log.time_s[row]));
    log.swivel_rad.row(row).setConstant(std::sin(log.time_s[row / 2 * 2]));
    log.roll_pitch_yaw_rad.row(row).setConstant(std::sin(log.time_s[row / 5 * 5]));
  }
  const std::optional<Log> anew = rows_read_anew(log);
  ASSERT_TRUE(anew.has_value());
  ASSERT_EQ(anew->sample_count(), 40);
  for (Eigen::Index row = 0; row < 40; ++row) {
    EXPECT_EQ(anew->time_s[row], log.time_s[5 * row]);
    EXPECT_EQ(anew->length_m.row(row), log.length_m.row(5 * row));
    EXPECT_EQ(anew->roll_pitch_yaw_rad.row(row), log.roll_pitch_yaw_rad.row(5 * row));
  }
  log.swivel_rad = log.length_m;
  log.roll_pitch_yaw_rad.resize(200, 0);
  EXPECT_FALSE(rows_read_anew(log).has_value());
}

}  // namespace
}  // namespace cdprcal::test
