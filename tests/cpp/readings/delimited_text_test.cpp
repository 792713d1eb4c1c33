#include "cdprcal/readings/delimited_text.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
using Indices = std::vector<std::int64_t>;

/// Columns of all lines of a text.
NumberTable all_lines(std::string_view text, const Indices& columns) {
  TextLines lines = text_lines(text);
  lines.begin.pop_back();
  return number_table(text, lines.begin, columns);
}

TEST(TextLines, BeginAndCommas) {
  const TextLines lines = text_lines("a,b\n\n,,,\nlast,");
  EXPECT_EQ(lines.begin, (Indices{0, 4, 5, 9, 14}));
  EXPECT_EQ(lines.commas, (std::vector<std::int32_t>{1, 0, 3, 1}));
}

TEST(TextLines, NothingHasNoLines) {
  EXPECT_EQ(text_lines("").begin, Indices{0});
  EXPECT_EQ(text_lines("\n").begin, (Indices{0, 1}));
}

TEST(NumberTable, PicksColumns) {
  const NumberTable table = all_lines("3,1.5,-2e-3,7\n4,+0.25, 8 ,\t9\r\n", {1, 3});
  ASSERT_FALSE(table.wrong);
  EXPECT_EQ(table.values, (LogMatrix(2, 2) << 1.5, 7, 0.25, 9).finished());
}

TEST(NumberTable, BlankCellsAndMissingColumnsAreNaN) {
  const NumberTable table = all_lines("1,,\n1\n1, \t,3\n", {1, 2});
  ASSERT_FALSE(table.wrong);
  EXPECT_TRUE(table.values.col(0).array().isNaN().all());
  EXPECT_TRUE(std::isnan(table.values(0, 1)));
  EXPECT_TRUE(std::isnan(table.values(1, 1)));
  EXPECT_EQ(table.values(2, 1), 3.0);
}

TEST(NumberTable, SaysWhichCellIsNoNumber) {
  for (const char* cell : {"x", "1x", "1 2", "0x10", "1,5x", "--1", "+-1", "1e", "."}) {
    const NumberTable table = all_lines("0,1,2\n0, " + std::string(cell) + " ,3\n", {1, 2});
    ASSERT_TRUE(table.wrong) << cell;
    EXPECT_EQ(table.wrong->line, 1);
    EXPECT_EQ(table.values.rows(), 1);
  }
  const NumberTable table = all_lines("0,1\n0, abc \n", {0, 1});
  ASSERT_TRUE(table.wrong);
  EXPECT_EQ(table.wrong->column, 1);
  EXPECT_EQ(table.wrong->text, "abc");
}

TEST(NumberTable, BeyondDoublePrecision) {
  const NumberTable table = all_lines("1e999,-1e999,1e-999,inf,nan", {0, 1, 2, 3, 4});
  ASSERT_FALSE(table.wrong);
  EXPECT_EQ(table.values(0, 0), kInf);
  EXPECT_EQ(table.values(0, 1), -kInf);
  EXPECT_EQ(table.values(0, 2), 0.0);
  EXPECT_EQ(table.values(0, 3), kInf);
  EXPECT_TRUE(std::isnan(table.values(0, 4)));
}

TEST(NumberTable, RefusesLinesAndColumnsThatAreNotThere) {
  EXPECT_THROW((void)number_table("1\n", Indices{3}, Indices{0}), InputError);
  EXPECT_THROW((void)number_table("1\n", Indices{-1}, Indices{0}), InputError);
  EXPECT_THROW((void)number_table("1\n", Indices{0}, Indices{1, 1}), InputError);
  EXPECT_THROW((void)number_table("1\n", Indices{0}, Indices{-1}), InputError);
}

}  // namespace
}  // namespace cdprcal
