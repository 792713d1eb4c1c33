// Measurements as a log, and back.
#include "cdprcal/readings/measurement.hpp"

#include <gtest/gtest.h>

#include "../support/run.hpp"
#include "cdprcal/calibration/calibrate.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/readings/run.hpp"

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

TEST(Measurement, IsOfSamplesAndCablesThatThereAre) {
  const Log log = test::startup_log(load_robot("irma4"), 0.2, 441, 0);
  constexpr PoseKind kRest = PoseKind::static_pose;
  const Eigen::Index n = log.sample_count();
  EXPECT_EQ(measurement_at(log, n - 1, kRest, 4).time_s, log.time_s[n - 1]);
  for (const Eigen::Index index : {Eigen::Index{-1}, n, Eigen::Index{1'000'000'000}}) {
    EXPECT_THROW(measurement_at(log, index, kRest, 4), InputError) << index;
  }
  for (const SampleRange range : {SampleRange{5, 5}, {7, 5}, {-2, 5}, {0, n + 1}}) {
    EXPECT_THROW(measurement_mean(log, range, kRest, 4), InputError) << range.begin;
  }
  for (const int cables : {-3, 9, 100}) {
    EXPECT_THROW(measurement_at(log, 0, kRest, cables), InputError) << cables;
  }
}

TEST(Measurement, ALogWithoutANameIsCalledTheLog) {
  Log log = test::startup_log(load_robot("irma4"), 0.2, 441, 0);
  log.source.clear();
  try {
    (void)run_of(log, 7);
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find("the log: segment 7"), 0U) << error.what();
  }
}

}  // namespace
}  // namespace cdprcal
