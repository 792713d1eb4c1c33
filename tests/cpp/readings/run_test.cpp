// Which part of a log is the run, and whether the log is this robot's.
#include "cdprcal/readings/run.hpp"

#include <gmock/gmock.h>

#include "cdprcal/error.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "support/refusal.hpp"

namespace cdprcal {
namespace {

Log three_segments(int cables) {
  Log log;
  log.source = "three.csv";
  log.time_s = Eigen::VectorXd(7);
  log.time_s << 0.0, 0.1, 10.0, 10.1, 10.2, 20.0, 20.1;
  log.length_m = LogMatrix::Zero(7, cables);
  return log;
}

TEST(Run, IsTheLastSegmentOrTheOneAskedFor) {
  const Log log = three_segments(4);
  EXPECT_EQ(run_of(log, -1).begin, 5);
  EXPECT_EQ(run_of(log, -1).end, 7);
  EXPECT_EQ(run_of(log, 0).end, 2);
  EXPECT_EQ(run_of(log, 1).begin, 2);
  EXPECT_EQ(run_of(log, 1).end, 5);
  EXPECT_THAT(test::refusal_of([&] { run_of(log, 3); }),
              testing::AllOf(testing::StartsWith("three.csv: segment 3 asked for"),
                             testing::HasSubstr("the log has 3")));
}

TEST(Run, IsNoneWhereTimesAreMilliseconds) {
  Log log;
  log.source = "ms.csv";
  log.time_s = Eigen::VectorXd::LinSpaced(500, 0.0, 499.0 * 50.0);
  log.length_m = LogMatrix::Zero(500, 4);
  EXPECT_THAT(test::refusal_of([&] { run_of(log, -1); }),
              testing::AllOf(testing::StartsWith("ms.csv: time_s advances by 50 s"),
                             testing::HasSubstr("milliseconds")));
}

TEST(Run, BelongsToARobotOfAsManyCables) {
  const Robot robot = load_robot("irma4");
  EXPECT_EQ(test::refusal_of([&] { check_belongs(robot, three_segments(4)); }), "accepted");
  EXPECT_THAT(test::refusal_of([&] { check_belongs(robot, three_segments(5)); }),
              testing::HasSubstr("the log has 5 cables, robot 'irma4' has 4"));
  EXPECT_THAT(test::refusal_of([&] { check_belongs(robot, three_segments(0)); }),
              testing::HasSubstr("says nothing of any cable"));
  Log empty;
  empty.source = "empty.csv";
  EXPECT_THAT(test::refusal_of([&] { check_belongs(robot, empty); }),
              testing::HasSubstr("empty.csv: the log has no samples"));
}

}  // namespace
}  // namespace cdprcal
