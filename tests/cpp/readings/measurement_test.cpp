// Measurements as a log, and back.
#include "cdprcal/readings/measurement.hpp"

#include <gtest/gtest.h>

#include "../support/run.hpp"
#include "cdprcal/calibration/calibrate.hpp"

namespace cdprcal {
namespace {

TEST(MeasurementsAsALog, AreTheSameReadings) {
  const Robot robot = load_robot("irma4");
  const Log log = test::startup_log(robot, 0.2, 441, 0);
  const std::vector<Measurement> read = prepare(robot, log, {}).problem.measurements;
  Log rows = log_of(read);
  validate(rows);
  EXPECT_EQ(rows.sample_count(), static_cast<Eigen::Index>(read.size()));
  EXPECT_EQ(rows.direct_length_m.cols(), 0);  // which nothing read
  rows.length_m *= 2.0;
  rows.roll_pitch_yaw_rad.col(2).array() += 1.0;
  std::vector<Measurement> changed = read;
  take_readings(rows, changed);
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(changed[i].length_m, 2.0 * read[i].length_m);
    EXPECT_EQ(changed[i].swivel_rad, read[i].swivel_rad);
    EXPECT_EQ(changed[i].tension_N, read[i].tension_N);
    EXPECT_EQ(changed[i].roll_pitch_yaw_rad[0], read[i].roll_pitch_yaw_rad[0]);
    EXPECT_EQ(changed[i].roll_pitch_yaw_rad[2], read[i].roll_pitch_yaw_rad[2] + 1.0);
  }
}

}  // namespace
}  // namespace cdprcal
