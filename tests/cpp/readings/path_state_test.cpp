// From which side cables and swivels came.
#include "cdprcal/readings/path_state.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "cdprcal/readings/turn_over.hpp"
#include "cdprcal/robot_file/robot_file.hpp"

namespace cdprcal {
namespace {

constexpr Eigen::Index kLeg = 1000;  // rows: a step, which may be the resolution, is small

/// A log in which a length and a swivel of irma4 go evenly from each value to the next.
Log log_through(const Eigen::Vector4d& length_m, const Eigen::Vector4d& swivel_rad) {
  const Eigen::Index rows = 3 * kLeg + 1;
  Log log;
  log.time_s = 1.5 * Eigen::VectorXd::LinSpaced(rows, 0.0, static_cast<double>(rows - 1));
  log.length_m = LogMatrix::Zero(rows, 4);
  log.swivel_rad = LogMatrix::Zero(rows, 4);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Eigen::Index from = std::min<Eigen::Index>(i / kLeg, 2);
    const double part = static_cast<double>(i - from * kLeg) / kLeg;
    log.length_m(i, 0) = std::lerp(length_m[from], length_m[from + 1], part);
    log.swivel_rad(i, 0) = std::lerp(swivel_rad[from], swivel_rad[from + 1], part);
  }
  return log;
}

/// Of this cable or swivel, where the log has reached each value.
Eigen::Vector4d reached(const LogMatrix& values) {
  return {values(0, 0), values(kLeg, 0), values(2 * kLeg, 0), values(3 * kLeg, 0)};
}

TEST(PathState, NobodyKnowsFromWhichSideItCameBeforePowerOn) {
  const Robot robot = load_robot("irma4");
  const double half_m = 0.5 * turn_over_m(robot), half_rad = 0.5 * kTurnOver_rad;
  // Nothing; half of a turn-over, which leaves the lower half of the range no place; all of it;
  // back by a quarter.
  const PathState path =
      path_state(robot, log_through({0.0, half_m, 3.0 * half_m, 2.5 * half_m},
                                    {0.0, -half_rad, -3.0 * half_rad, -2.5 * half_rad}));
  const Eigen::Vector4d s(0.0, 0.5, 1.0, 0.5), open(1.0, 0.5, 0.0, 0.0);
  EXPECT_LE((reached(path.length_direction) - s).norm(), 0.01);
  EXPECT_LE((reached(path.length_direction_open) - open).norm(), 0.01);
  EXPECT_LE((reached(path.swivel_direction) + s).norm(), 0.01);
  EXPECT_LE((reached(path.swivel_direction_open) - open).norm(), 0.01);
  // Cables that never move keep their secret.
  EXPECT_EQ(path.length_direction_open.rightCols(3), LogMatrix::Ones(3 * kLeg + 1, 3));
}

}  // namespace
}  // namespace cdprcal
