// A model of poses that were read once each, without a log.
#pragma once

#include <gtest/gtest.h>

#include <vector>

#include "cdprcal/estimation/model.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal::test {

/// One run through these stops, read with this noise and offsets from the seed; fitted.
inline DiagnosisModel fitted_rests(const Robot& robot, const std::vector<SyntheticStop>& stops,
                                   PoseKind kind, const ReadingNoise& noise, std::uint64_t seed) {
  DiagnosisModel model;
  model.robot = robot;
  RandomNormal random(seed);
  const ReadingOffsets offsets = random_offsets(robot.cable_count(), random);
  DiagnosisRun run;
  for (const SyntheticStop& stop : stops) {
    run.measurements.push_back(
        synthetic_measurement(robot, stop.pose, stop.tension_N, kind, offsets, noise, random));
    run.poses.push_back(stop.pose);
  }
  run.offsets = offsets_at(robot, run.poses[0], run.measurements[0]);
  model.runs.push_back(run);
  start_noise(model, Signals{});
  EXPECT_TRUE(fit_with_noise(model));
  return model;
}

}  // namespace cdprcal::test
