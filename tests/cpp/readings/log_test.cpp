#include "cdprcal/readings/log.hpp"

#include <gtest/gtest.h>

#include <charconv>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <random>

#include "../support/damaged.hpp"
#include "../support/random_robot.hpp"
#include "../support/shared_data.hpp"
#include "cdprcal/error.hpp"

namespace cdprcal {
namespace {

using Eigen::Index;

const std::string kHeader = "time_s,length_1_m,length_2_m\n";

void expect_refused(const std::string& text, const std::string& message) {
  try {
    parse_log(text, "run.csv");
    ADD_FAILURE() << "accepted: " << text.substr(0, 100);
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).rfind(message, 0), 0U) << error.what();
  }
}

/// Equal to the bit, NaN equal to NaN.
bool same(const LogMatrix& a, const LogMatrix& b) {
  if (a.rows() != b.rows() || a.cols() != b.cols()) return false;
  for (Index i = 0; i < a.size(); ++i) {
    const double x = a.data()[i], y = b.data()[i];
    if (!(x == y && std::signbit(x) == std::signbit(y)) && !(std::isnan(x) && std::isnan(y))) {
      return false;
    }
  }
  return true;
}

Log random_log(test::Rng& rng, Index samples, Index cables) {
  const auto matrix = [&](Index columns) {
    LogMatrix m(samples, columns);
    for (Index i = 0; i < m.size(); ++i) {
      const auto choice = rng() % 20;
      m.data()[i] = choice == 0   ? kNaN
                    : choice == 1 ? -0.0
                    : choice == 2
                        ? test::uniform(rng, -1.0, 1.0) * 1e-310
                        : test::uniform(rng, -1.0, 1.0) * std::pow(10.0, double(rng() % 40) - 20);
    }
    return m;
  };
  Log log;
  log.source = "random";
  log.time_s.resize(samples);
  double time = test::uniform(rng, -10.0, 1e9);
  for (Index i = 0; i < samples; ++i) log.time_s[i] = time += test::uniform(rng, 1e-3, 1.0);
  log.length_m = matrix(cables);
  log.swivel_rad = matrix(rng() % 2 == 0 ? cables : 0);
  log.tension_N = matrix(rng() % 2 == 0 ? cables : 0);
  log.tension_setpoint_N = matrix(rng() % 2 == 0 ? cables : 0);
  log.roll_pitch_yaw_rad = matrix(rng() % 2 == 0 ? 3 : 0);
  return log;
}

TEST(Log, ReadsColumnsInAnyOrderAndLeavesAbsentSensorsOut) {
  const Log log =
      parse_log("yaw_rad,length_2_m,time_s,length_1_m\n0.3,2,10,1\n,nan,10.5,-1e-3\n", "run.csv");
  EXPECT_EQ(log.source, "run.csv");
  EXPECT_EQ(log.sample_count(), 2);
  EXPECT_EQ(log.cable_count(), 2);
  EXPECT_EQ(log.time_s, Eigen::Vector2d(10.0, 10.5));
  LogMatrix length(2, 2), attitude(2, 3);
  length << 1.0, 2.0, -1e-3, kNaN;
  attitude << kNaN, kNaN, 0.3, kNaN, kNaN, kNaN;
  EXPECT_TRUE(same(log.length_m, length));
  EXPECT_TRUE(same(log.roll_pitch_yaw_rad, attitude));
  for (const LogMatrix* absent : {&log.swivel_rad, &log.tension_N, &log.tension_setpoint_N}) {
    EXPECT_EQ(absent->rows(), 2);
    EXPECT_EQ(absent->cols(), 0);
  }
}

TEST(Log, ToleratesWhatEditorsAndSpreadsheetsDo) {
  const Log plain = parse_log(kHeader + "0,1,2\n1,3,4\n", "plain");
  for (const std::string& text :
       {"\xEF\xBB\xBF" + kHeader + "0,1,2\n1,3,4\n", kHeader + "0,1,2\n1,3,4",
        std::string("time_s,length_1_m,length_2_m\r\n0,1,2\r\n1,3,4\r\n"),
        kHeader + "0,1,2\n1,3,4\n\n \r\n\n", "# made by hand\n#\n\n" + kHeader + "0,1,2\n1,3,4\n",
        kHeader + "0,1,2\n# 0.5 s: settling\n1,3,4\n# the end\n",
        kHeader + "0 , +1,\t2\n1.0,3e0,4.\n",
        std::string("time_s , length_1_m, length_2_m\n0,1,2\n1,3,4\n")}) {
    const Log log = parse_log(text, "run.csv");
    EXPECT_EQ(log.time_s, plain.time_s) << text;
    EXPECT_TRUE(same(log.length_m, plain.length_m)) << text;
  }
}

TEST(Log, ColumnErrorsNameTheLineAndTheColumn) {
  expect_refused("length_1_m\n1\n", "run.csv:1: column time_s: is missing");
  expect_refused("# x\ntime_s,speed_1\n", "run.csv:2: column 'speed_1': unknown");
  expect_refused("time_s,length_01_m\n", "run.csv:1: column 'length_01_m': unknown");
  expect_refused("time_s,length_0_m\n", "run.csv:1: column 'length_0_m': unknown");
  expect_refused("time_s,length_9_m\n", "run.csv:1: column length_9_m: cables are numbered 1 to 8");
  expect_refused("time_s,yaw_rad,yaw_rad\n", "run.csv:1: column yaw_rad: given twice");
  expect_refused("time_s,time_s\n", "run.csv:1: column time_s: given twice");
  expect_refused("time_s,length_1_m,length_3_m\n", "run.csv:1: column length_2_m: is missing");
  expect_refused("time_s,length_1_m,length_2_m,tension_1_N\n",
                 "run.csv:1: column tension_2_N: is missing");
  expect_refused("time_s;length_1_m\n0;1\n",
                 "run.csv:1: column 'time_s;length_1_m': unknown; "
                 "columns must be separated by commas");
  expect_refused("time_s\tlength_1_m\n0\t1\n",
                 "run.csv:1: column 'time_s length_1_m': unknown; "
                 "columns must be separated by commas");
  expect_refused("time_s,\n", "run.csv:1: column '': unknown");
  expect_refused("time_s,a\x1b[31m\n", "run.csv:1: column 'a [31m': unknown");
}

TEST(Log, CellErrorsNameTheLineAndTheColumn) {
  for (const char* bad : {"abc", "1.2.3", "0x10", "1 2", "--1", "+-1", "1e", "-", "1,"}) {
    expect_refused(kHeader + "0,1,1\n1," + bad + ",2\n", "run.csv:3: ");
  }
  expect_refused(kHeader + "0,1,abc\n", "run.csv:2: column length_2_m: 'abc' is not a number");
  expect_refused(kHeader + "0,inf,1\n", "run.csv:2: column length_1_m: infinite");
  expect_refused(kHeader + "0,1,-Infinity\n", "run.csv:2: column length_2_m: infinite");
  expect_refused(kHeader + "0,1e999,1\n", "run.csv:2: column length_1_m: '1e999' is beyond");
  expect_refused(kHeader + "0,1,2\n1,1\n", "run.csv:3: has 2 cells, the header has 3");
  expect_refused(kHeader + "0,1,2,3\n", "run.csv:2: has 4 cells, the header has 3");
  expect_refused(kHeader + "0,1,2,\n", "run.csv:2: has 4 cells, the header has 3");
  expect_refused(kHeader + "0,1,2\n1,1", "run.csv:3: has 2 cells, the header has 3; the file ends");
  expect_refused(kHeader + "0,1,2\n\n1,1,2\n", "run.csv:3: a blank line among the samples");
}

TEST(Log, TimeIsThereAndIncreases) {
  expect_refused(kHeader + "0,1,2\n0,1,2\n", "run.csv:3: column time_s: time must increase");
  expect_refused(kHeader + "5,1,2\n4,1,2\n", "run.csv:3: column time_s: time must increase");
  expect_refused(kHeader + ",1,2\n", "run.csv:2: column time_s: is empty");
  expect_refused(kHeader + "nan,1,2\n", "run.csv:2: column time_s: is empty");
}

TEST(Log, FilesThatAreNoLogs) {
  expect_refused("", "run.csv: is empty");
  expect_refused("\n\n", "run.csv: is empty");
  expect_refused("# only a comment\n", "run.csv: is empty");
  expect_refused(kHeader, "run.csv:1: no samples follow the header");
  expect_refused(kHeader + std::string("0,1,2\n0,\0\0\0", 12), "run.csv:3: holds NUL bytes");
  EXPECT_THROW(read_log("/no/such/file.csv"), InputError);
  EXPECT_THROW(read_log(::testing::TempDir()), InputError);
}

TEST(Log, WriterAndReaderAreInverseToTheBit) {
  test::Rng rng(81);
  const std::string path =
      (std::filesystem::path(::testing::TempDir()) / "cdprcal_log_test.csv").string();
  for (int i = 0; i < 100; ++i) {
    const Log log = random_log(rng, 1 + static_cast<Index>(rng() % 30), 1 + i % 8);
    write_log(log, path);
    const Log back = read_log(path);
    EXPECT_EQ(back.source, path);
    EXPECT_EQ(back.time_s, log.time_s);
    EXPECT_TRUE(same(back.length_m, log.length_m));
    EXPECT_TRUE(same(back.swivel_rad, log.swivel_rad));
    EXPECT_TRUE(same(back.tension_N, log.tension_N));
    EXPECT_TRUE(same(back.tension_setpoint_N, log.tension_setpoint_N));
    EXPECT_TRUE(same(back.roll_pitch_yaw_rad, log.roll_pitch_yaw_rad));
    EXPECT_EQ(format_log(back), format_log(log));
  }
  std::filesystem::remove(path);
  EXPECT_THROW(write_log(random_log(rng, 3, 4), "/no/such/folder/log.csv"), InputError);
}

TEST(Log, NumbersAreWrittenAsToCharsWritesThem) {
  std::mt19937_64 random(3);
  std::vector<double> values{0.0,      -0.0,    0.001,     0.00099,  0.000999999, 1e-6, 99999.5,
                             99999.99, 100000., 1234567.5, 20000.,   10000.,      1.0,  0.1 + 0.2,
                             1.000001, 7e-300,  1e300,     0.001001, 0.5e-6,      3.14};
  for (int k = 0; k < 200'000; ++k) {
    const double whole = static_cast<double>(random() % 20'000'000'000) - 1e10;
    const double power = std::pow(10.0, static_cast<double>(random() % 12));
    const double value = whole / power;
    values.insert(values.end(), {value, std::nextafter(value, 0.0), -value * 1e-3});
  }
  Log log;
  log.time_s = Eigen::VectorXd::LinSpaced(static_cast<Index>(values.size()), 0.0, 1e6);
  log.length_m = Eigen::Map<const Eigen::VectorXd>(values.data(), log.time_s.size());
  const std::string text = format_log(log);
  std::size_t at = text.find('\n') + 1;
  for (const double value : values) {
    at = text.find(',', at) + 1;
    std::array<char, 32> wanted;
    const char* const end = std::to_chars(wanted.data(), wanted.data() + 32, value).ptr;
    const std::string_view expected(wanted.data(), static_cast<std::size_t>(end - wanted.data()));
    ASSERT_EQ(std::string_view(text).substr(at, text.find('\n', at) - at), expected);
  }
}

TEST(Log, ValidateChecksLogsMadeByHand) {
  test::Rng rng(82);
  const auto refused = [&](const auto& change) {
    Log log = random_log(rng, 5, 3);
    log.swivel_rad = log.length_m;
    log.roll_pitch_yaw_rad = LogMatrix::Zero(5, 3);
    EXPECT_NO_THROW(validate(log));
    change(log);
    EXPECT_THROW(validate(log), InputError);
    EXPECT_THROW(format_log(log), InputError);
  };
  refused([](Log& log) { log.time_s.resize(0); });
  refused([](Log& log) { log.time_s[3] = log.time_s[2]; });
  refused([](Log& log) { log.time_s[0] = kNaN; });
  refused([](Log& log) { log.swivel_rad = LogMatrix::Zero(5, 2); });
  refused([](Log& log) { log.swivel_rad = LogMatrix::Zero(4, 3); });
  refused([](Log& log) { log.roll_pitch_yaw_rad = LogMatrix::Zero(5, 2); });
  refused([](Log& log) { log.length_m(1, 1) = std::numeric_limits<double>::infinity(); });
  refused([](Log& log) { log.length_m = LogMatrix::Zero(5, 9); });
}

TEST(Log, AGapOfMoreThanTwoSecondsStartsASegment) {
  const Log log = parse_log("time_s\n0\n1\n3\n5.5\n6\n60\n", "run.csv");
  EXPECT_EQ(log.cable_count(), 0);
  const std::vector<SampleRange> ranges = segments(log);
  ASSERT_EQ(ranges.size(), 3U);
  const Index expected[3][2] = {{0, 3}, {3, 5}, {5, 6}};  // a gap of exactly 2 s is none
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(ranges[i].begin, expected[i][0]);
    EXPECT_EQ(ranges[i].end, expected[i][1]);
  }
  EXPECT_EQ(segments(log, 100.0).size(), 1U);
  EXPECT_TRUE(segments(Log{}).empty());
}

TEST(Log, RandomDamageIsRefusedOrReadNeverAnythingElse) {
  test::Rng rng(84);
  const std::string text = format_log(random_log(rng, 20, 4));
  int refused = 0;
  for (int i = 0; i < 5000; ++i) {
    const std::string damaged = test::damaged(text, rng);
    try {
      validate(parse_log(damaged, "damaged"));
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000);
  EXPECT_LT(refused, 5000);  // a changed digit is still a log
}

TEST(Log, AnHourAt100HzReadsInWellUnderASecond) {
  test::Rng rng(83);
  Log hour;
  hour.time_s = Eigen::VectorXd::LinSpaced(360'000, 0.0, 3600.0);
  for (LogMatrix* group : {&hour.length_m, &hour.swivel_rad, &hour.tension_N}) {
    group->resize(360'000, 4);
    for (Index i = 0; i < group->size(); ++i) group->data()[i] = test::uniform(rng, -1.0, 1.0);
  }
  const std::string text = format_log(hour);
  double best_s = 1e9;  // of three
  for (int i = 0; i < 3; ++i) {
    const std::clock_t start = std::clock();  // of the processor: other programs run too
    const Log back = parse_log(text, "hour.csv");
    const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    best_s = std::min(best_s, seconds);
    EXPECT_TRUE(same(back.tension_N, hour.tension_N));
  }
#if defined(NDEBUG) && !defined(__SANITIZE_ADDRESS__)
  EXPECT_LT(best_s, 1.0);
#else
  EXPECT_LT(best_s, 20.0);  // not optimised, or instrumented
#endif
}

TEST(Log, ReadsTheMeasuredRun) {
  const std::string path = test::shared_data("irma4/trial_a.csv");
  if (path.empty()) GTEST_SKIP() << "no shared data: irma4/trial_a.csv";
  const Log log = read_log(path);
  EXPECT_EQ(log.cable_count(), 4);
  EXPECT_EQ(log.sample_count(), 1280);
  for (const LogMatrix* group : {&log.length_m, &log.swivel_rad, &log.tension_N,
                                 &log.tension_setpoint_N, &log.roll_pitch_yaw_rad}) {
    EXPECT_TRUE(group->allFinite());
  }
  EXPECT_EQ(log.time_s[0], 257.854);
  EXPECT_EQ(log.roll_pitch_yaw_rad(1, 2), 0.009068216);
  EXPECT_EQ(parse_log(format_log(log), path).tension_N, log.tension_N);
}

}  // namespace
}  // namespace cdprcal
