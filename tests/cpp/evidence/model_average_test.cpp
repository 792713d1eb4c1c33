// What the log cannot rule out, in the covariance of the initial pose.
#include "cdprcal/evidence/model_average.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "../support/run.hpp"
#include "cdprcal/diagnosis/baseline.hpp"
#include "cdprcal/geometry/pose.hpp"

namespace cdprcal {
namespace {

const DiagnosisModel& clean() {
  static const DiagnosisModel model = [] {
    std::vector<Log> logs{test::startup_log(load_robot("irma4"), 0.2, 421, 0)};
    std::vector<std::string> left_out;
    return baseline_model(load_robot("irma4"), logs, left_out);
  }();
  return model;
}

TEST(ModelAverage, AnEffectThatMayBeThereWidensThePoseAsIfItWereFree) {
  for (const char* name : {"centre_of_mass", "frame_anchors", "transmission_ratio", "yaw_drift"}) {
    SCOPED_TRACE(name);
    const auto effect = find_effect(name);
    const std::vector<CandidateScore> scores = scan(clean(), {effect}, {.draws = 0});
    const Unseen unseen = covariance_of_unseen(clean(), scores);
    // The same by another way: the effect in the model, at nothing.
    DiagnosisModel with = clean();
    with.effects.push_back({effect, EffectValues::Zero(effect->size(4))});
    const Matrix6 expected = initial_pose_covariance(with, 0) - initial_pose_covariance(clean(), 0);
    EXPECT_LE((unseen.possible - expected).norm(), 1e-4 * expected.norm());
  }
}

TEST(ModelAverage, WhatTheReadingsSpeakAgainstAddsNothing) {
  const std::vector<CandidateScore> scores =
      scan(clean(), {find_effect("transmission_ratio")}, {.draws = 0});
  ASSERT_LT(scores[0].log_evidence, -3.0);
  const Unseen unseen = covariance_of_unseen(clean(), scores);
  EXPECT_LT(unseen.probable.trace(), 0.05 * unseen.possible.trace());
  std::vector<CandidateScore> found = scores;
  found[0].log_evidence = 30.0;
  EXPECT_GE(covariance_of_unseen(clean(), found).probable.trace(), unseen.possible.trace());
}

TEST(ModelAverage, AlternativesCountByTheirEvidence) {
  Vector6 twist;
  twist << 0.01, 0.0, 0.0, 0.0, 0.02, 0.0;
  const Pose here, there = plus(here, twist);
  const auto of = [&](double log_evidence) {
    return covariance_of_alternatives(here, {{there, log_evidence}});
  };
  EXPECT_LE((of(0.0) - 0.5 * twist * twist.transpose()).norm(), 1e-12);
  EXPECT_LT(of(-10.0).norm(), 1e-4 * of(0.0).norm());
  EXPECT_EQ(covariance_of_alternatives(here, {}), Matrix6::Zero());
}

}  // namespace
}  // namespace cdprcal
