// The plan file: the same plan back to the last bit, and every refusal at its place.
#include "cdprcal/planning/plan_file.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <random>

#include "cdprcal/error.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "support/refusal.hpp"

namespace cdprcal {
namespace {

const Plan& irma4_plan() {
  static const Plan plan = make_plan(load_robot("irma4")).plan;
  return plan;
}

void expect_same(const Plan& a, const Plan& b) {
  EXPECT_EQ(a.robot_name, b.robot_name);
  EXPECT_EQ(a.start_tension_N, b.start_tension_N);
  EXPECT_EQ(a.start_pose.position_m, b.start_pose.position_m);
  EXPECT_EQ(a.start_pose.rotation.coeffs(), b.start_pose.rotation.coeffs());
  EXPECT_EQ(a.start_dwell_s, b.start_dwell_s);
  EXPECT_EQ(a.duration_s, b.duration_s);
  for (int i = 0; i < 6; ++i) {
    const double x = a.predicted_standard_deviation[i], y = b.predicted_standard_deviation[i];
    EXPECT_TRUE(x == y || (std::isnan(x) && std::isnan(y)));
  }
  ASSERT_EQ(a.poses.size(), b.poses.size());
  for (std::size_t i = 0; i < a.poses.size(); ++i) {
    EXPECT_EQ(a.poses[i].measured, b.poses[i].measured);
    EXPECT_EQ(a.poses[i].pose.position_m, b.poses[i].pose.position_m);
    EXPECT_EQ(a.poses[i].pose.rotation.coeffs(), b.poses[i].pose.rotation.coeffs());
    EXPECT_EQ(a.poses[i].tension_N, b.poses[i].tension_N);
    EXPECT_EQ(a.poses[i].transition_s, b.poses[i].transition_s);
    EXPECT_EQ(a.poses[i].dwell_s, b.poses[i].dwell_s);
    EXPECT_EQ(a.poses[i].natural_frequencies_hz, b.poses[i].natural_frequencies_hz);
    EXPECT_EQ(a.poses[i].constant_tension_frequencies_hz,
              b.poses[i].constant_tension_frequencies_hz);
  }
}

TEST(PlanFile, RoundTripToTheLastBit) {
  expect_same(parse_plan(format_plan(irma4_plan()), "text"), irma4_plan());
  Plan odd = irma4_plan();
  odd.robot_name = "a robot, with a comma: and # more";
  odd.poses[2].measured = false;
  odd.predicted_standard_deviation.setConstant(kNaN);
  for (PlannedPose& p : odd.poses) p.natural_frequencies_hz.resize(0);
  const Plan back = parse_plan(format_plan(odd), "text");
  expect_same(back, odd);
  EXPECT_EQ(back.measured_count(), 7);
  const auto path = std::filesystem::temp_directory_path() /
                    ("cdprcal_plan_" + std::to_string(std::random_device{}()) + ".csv");
  write_plan(odd, path.string());
  expect_same(read_plan(path.string()), odd);
  std::filesystem::remove(path);
}

TEST(PlanFile, IsReadAsPeopleAndSpreadsheetsChangeIt) {
  const std::string text = format_plan(irma4_plan());
  std::string windows = "\xEF\xBB\xBF";
  for (const char c : text) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  expect_same(parse_plan(windows, "text"), irma4_plan());
  std::string spaced = "# a remark\n\n";
  for (const char c : text) spaced += c == ',' ? std::string(" , ") : std::string(1, c);
  expect_same(parse_plan(spaced + "\n# the end\n", "text"), irma4_plan());
}

/// The message of the refusal.
std::string refusal(const std::string& text) {
  return test::refusal_of([&] { parse_plan(text, "plan.csv"); });
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

/// The text with cell `column` of data row `row` (from 1) replaced.
std::string with_cell(const std::string& text, int row, int column, const std::string& value) {
  std::size_t at = text.find("\npurpose");
  for (int r = 0; r < row; ++r) at = text.find('\n', at + 1);
  for (int c = 0; c < column; ++c) at = text.find(',', at + 1);
  const std::size_t end = text.find_first_of(",\n", at + 1);
  return text.substr(0, at + 1) + value + text.substr(end);
}

TEST(PlanFile, EveryRefusalNamesItsPlace) {
  const std::string good = format_plan(irma4_plan());
  ASSERT_EQ(refusal(good), "accepted");
  const auto expect = [](const std::string& text, const std::string& place,
                         const std::string& problem) {
    const std::string message = refusal(text);
    EXPECT_EQ(message.rfind("plan.csv:" + place, 0), 0U) << message;
    EXPECT_NE(message.find(problem), std::string::npos) << message;
  };
  expect("", "1:1: ", "no table");
  expect("# robot: x\n", "1:1: ", "no table");
  expect(std::string("a\0b", 3), "1:2: ", "NUL");
  expect(with_cell(good, 1, 1, "abc"), "10:9: ", "must be a number, not 'abc'");
  expect(with_cell(good, 2, 8, "-1"), "11:", "tension_1_N: a tension must be positive");
  expect(with_cell(good, 2, 8, ""), "11:", "tension_1_N");
  expect(with_cell(good, 2, 8, "inf"), "11:", "finite");
  expect(with_cell(good, 2, 8, "nan"), "11:", "finite");
  expect(with_cell(good, 2, 8, "1e999"), "11:", "number");
  expect(with_cell(good, 3, 4, "0.5"), "12:", "norm");
  expect(with_cell(good, 3, 0, "wait"), "12:1: ", "neither measure nor via");
  expect(with_cell(good, 4, 12, "-2"), "13:", "transition_s: must not be negative");
  expect(with_cell(good, 4, 13, "-2"), "13:", "dwell_s: must not be negative");
  expect(with_cell(good, 4, 13, "1,2"), "13:", "cells");
  expect(replaced(good, "dwell_s,", "dwell,"), "9:", "unknown column 'dwell'");
  expect(replaced(good, "dwell_s,", "time_s,"), "9:", "as logs have it; give a plan");
  expect(replaced(good, "tension_2_N", "tension_5_N"), "9:", "unknown column");
  expect(replaced(good, "tension_2_N", "tension_1_N"), "9:", "appears twice");
  expect(replaced(good, "purpose,", "pose,"), "9:1: ", "unknown column 'pose'");
  expect(replaced(good, "purpose,", "\x1bpose,"), "9:1: ", "unknown column ' pose'");
  expect(replaced(good, "robot: irma4", "robot: ir\x16ma4"), "2:9: ", "control characters");
  expect(replaced(good, "# robot: irma4\n", ""), "", "'# robot: …' is missing");
  expect(replaced(good, "# stops: 8\n", ""), "", "'# stops: …' is missing");
  expect(replaced(good, "# robot: irma4", "# robot: "), "2:", "name is missing");
  expect(replaced(good, "# stops: 8", "# stops: 8\n# stops: 8"), "8:1: ", "twice, first on line 7");
  expect(replaced(good, "# start_tension_N: ", "# start_tension_N: 50, "), "", "tensions of 4");
  expect(replaced(good, "# start_tension_N: ", "# start_tension_N: x, "), "3:20: ", "number");
  expect(replaced(good, "# start_position_m: ", "# start_position_m: 1, "), "4:", "give 3");
  expect(replaced(good, "# start_quaternion_wxyz: 1", "# start_quaternion_wxyz: 2"), "5:", "norm");
  expect(good.substr(0, good.rfind("\nmeasure") + 1), "", "7 stops where 8 are announced");
  expect(good.substr(0, good.size() - 30), "17:", "may be cut");
}

TEST(PlanFile, RandomDamageNeverPassesUnseenOrCrashes) {
  // Any byte changed: either an InputError, or a plan that differs only where the byte was.
  const std::string good = format_plan(irma4_plan());
  std::mt19937_64 rng(9);
  int refused = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    std::string text = good;
    const int damages = 1 + static_cast<int>(rng() % 3);
    for (int d = 0; d < damages; ++d) text[rng() % text.size()] = static_cast<char>(rng() % 256);
    if (trial % 3 == 0) text.resize(rng() % text.size());
    const std::string message = refusal(text);
    if (message == "accepted") continue;
    ++refused;
    EXPECT_EQ(message.rfind("plan.csv:", 0), 0U) << message;
  }
  EXPECT_GT(refused, 1500);
}

TEST(PlanFile, RefusesPlansAndPathsThatCannotBeWritten) {
  Plan plan = irma4_plan();
  EXPECT_THROW(write_plan(plan, "/nonexistent/plan.csv"), InputError);
  EXPECT_THROW((void)read_plan("/nonexistent/plan.csv"), InputError);
  EXPECT_THROW((void)read_plan(std::filesystem::temp_directory_path().string()), InputError);
  plan.robot_name = "two\nlines";
  EXPECT_THROW((void)format_plan(plan), InputError);
  plan = irma4_plan();
  plan.poses[1].tension_N.conservativeResize(3);
  EXPECT_THROW((void)format_plan(plan), InputError);
  EXPECT_THROW((void)format_plan(Plan{}), InputError);
}

}  // namespace
}  // namespace cdprcal
