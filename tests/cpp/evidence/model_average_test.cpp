// What the log cannot rule out, in the covariance of the initial pose.
#include "cdprcal/evidence/model_average.hpp"

#include <gtest/gtest.h>

#include <random>

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
    const Unseen unseen = unseen_effects(clean(), scores);
    // The same by another way: the effect in the model, at nothing.
    DiagnosisModel with = clean();
    with.effects.push_back({effect, EffectValues::Zero(effect->size(4))});
    const Matrix6 expected = initial_pose_covariance(with, 0) - initial_pose_covariance(clean(), 0);
    EXPECT_LE((unseen.possible - expected).norm(), 1e-4 * expected.norm());
  }
}

TEST(ModelAverage, AnEffectThatMayBeThereWidensTheValuesOfOthersAsIfItWereFree) {
  const auto with = [](DiagnosisModel model, const char* name) {
    const auto effect = find_effect(name);
    model.effects.push_back({effect, EffectValues::Zero(effect->size(4))});
    EXPECT_TRUE(fit(model, 50));
    return model;
  };
  const auto variance = [](const DiagnosisModel& model) {
    const Eigen::MatrixXd spread = covariance(model);
    return spread.diagonal().tail(model.values().size()).eval();
  };
  const DiagnosisModel model = with(clean(), "mass"), both = with(model, "load_cell_gain");
  std::vector<CandidateScore> scores = scan(model, {find_effect("load_cell_gain")}, {.draws = 0});
  scores[0].log_evidence = 1e3;  // it is there
  const Unseen unseen = unseen_effects(model, scores);
  ASSERT_EQ(unseen.of_values.size(), 1);
  const double shift = both.values()[0] - model.values()[0];
  const double expected = shift * shift + variance(both)[0] - variance(model)[0];
  EXPECT_GT(expected, 3.0 * variance(model)[0]);  // weights and gains look alike
  EXPECT_NEAR(unseen.of_values[0], expected, 0.05 * expected);
  scores[0].log_evidence = -1e3;
  EXPECT_LT(unseen_effects(model, scores).of_values[0], 0.05 * expected);
}

/// What possibilities add to a covariance of nothing, without any widening.
Matrix6 mean_of(const std::vector<Possibility>& others) {
  Matrix6 out = Matrix6::Zero();
  for (const Possibility& p : others) {
    out += p.probability * (p.shift * p.shift.transpose() + p.spread);
  }
  return out;
}

TEST(ModelAverage, WhatTheReadingsSpeakAgainstAddsNothing) {
  const std::vector<CandidateScore> scores =
      scan(clean(), {find_effect("transmission_ratio")}, {.draws = 0});
  ASSERT_LT(scores[0].log_evidence, -3.0);
  const Unseen unseen = unseen_effects(clean(), scores);
  // Beside it are the steps at the first move.
  EXPECT_LT(mean_of({unseen.each.front()}).trace(), 0.05 * unseen.possible.trace());
  std::vector<CandidateScore> found = scores;
  found[0].log_evidence = 30.0;
  EXPECT_GE(mean_of(unseen_effects(clean(), found).each).trace(), unseen.possible.trace());
}

TEST(ModelAverage, WhatTheRobotFileSaysIsThereWhateverSpeaksAgainstIt) {
  DiagnosisModel model = clean();
  for (Cable& cable : model.robot.cables) cable.pulley.position_sigma_m.setConstant(0.01);
  std::vector<CandidateScore> scores = scan(model, {find_effect("frame_anchors")}, {.draws = 0});
  scores[0].log_evidence = -30.0;
  const Unseen unseen = unseen_effects(model, scores);
  EXPECT_EQ(unseen.each.front().probability, 1.0);
  const Unseen unsaid = unseen_effects(clean(), scores);
  EXPECT_LT(unsaid.each.front().probability, 1e-6);
  EXPECT_GT(unseen.each.front().spread.trace(), 4.0 * unsaid.each.front().spread.trace());
}

TEST(ModelAverage, AlternativesCountByTheirEvidence) {
  Vector6 twist;
  twist << 0.01, 0.0, 0.0, 0.0, 0.02, 0.0;
  const InitialPose here{{}, Matrix6::Identity()},
      there{plus(here.pose, twist), Matrix6::Identity()};
  const auto of = [&](double log_evidence) {
    return mean_of(possibilities(here, {{there, log_evidence}}));
  };
  EXPECT_LE((of(0.0) - 0.5 * twist * twist.transpose()).norm(), 1e-12);
  EXPECT_LT(of(-10.0).norm(), 1e-4 * of(0.0).norm());
  EXPECT_TRUE(possibilities(here, {}).empty());
}

TEST(ModelAverage, AnotherModelCountsAsUncertainAsItIs) {
  // It knows less of x and yaw, and more of y, which is no reason to claim more.
  const InitialPose here{{}, Matrix6::Identity()};
  InitialPose there = here;
  there.covariance.diagonal() << 4.0, 0.25, 1.0, 1.0, 1.0, 9.0;
  const Possibility p = in_place_of(here, there, 0.25);
  EXPECT_EQ(p.probability, 0.25);
  EXPECT_LE(p.shift.norm(), 1e-15);
  Vector6 less_known;
  less_known << 3.0, 0.0, 0.0, 0.0, 0.0, 8.0;
  EXPECT_LE((p.spread - Matrix6(less_known.asDiagonal())).norm(), 1e-12);
}

TEST(ModelAverage, WhatGuidesHoldIsNoLessKnownToAnother) {
  InitialPose here, there;
  here.covariance.diagonal() << 1.0, 1.0, 4.0, 0.0, 0.0, 0.0;  // a platform that cannot turn
  here.covariance(0, 1) = here.covariance(1, 0) = 0.5;
  there.covariance = 3.0 * here.covariance;
  EXPECT_LE((in_place_of(here, there, 0.25).spread - 2.0 * here.covariance).norm(), 1e-12);
}

TEST(ModelAverage, WithoutOtherModelsACovarianceStays) {
  const Matrix6 own = initial_pose_covariance(clean(), 0);
  EXPECT_EQ(averaged_covariance(own, {}), own);
  // Nor does one that hardly moves the pose change more than its share.
  const Possibility small{0.03, Vector6::Constant(1e-9), 0.5 * own};
  EXPECT_LE((averaged_covariance(own, {small}) - 1.015 * own).norm(), 1e-3 * own.norm());
}

/// Of poses drawn from the mixture that the possibilities make of a normal distribution, how many
/// have a coordinate beyond so many stated σ.
TEST(ModelAverage, ARareModelThatPutsThePoseFarAwayIsWithinFourSigma) {
  const Matrix6 own = Vector6(1.0, 1.0, 4.0, 1.0, 1.0, 9.0).asDiagonal();
  Possibility rare;
  rare.probability = 0.03;
  rare.spread(0, 0) = 100.0;
  Possibility rarer;
  rarer.probability = 0.004;
  rarer.shift[2] = 40.0;
  const std::vector<Possibility> others{rare, rarer};
  const Matrix6 stated = averaged_covariance(own, others);
  const Matrix6 variance = own + mean_of(others);
  EXPECT_GT(stated(0, 0), 1.2 * variance(0, 0));
  EXPECT_GT(stated(2, 2), 1.2 * variance(2, 2));
  EXPECT_EQ(stated(1, 1), variance(1, 1));
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  int beyond = 0;
  constexpr int kDraws = 200000;
  for (int i = 0; i < kDraws; ++i) {
    Vector6 off;
    for (int axis = 0; axis < 6; ++axis) off[axis] = std::sqrt(own(axis, axis)) * normal(random);
    const double which = uniform(random);
    if (which < rare.probability) {
      off[0] += 10.0 * normal(random);
    } else if (which < rare.probability + rarer.probability) {
      off[2] += 40.0;
    }
    const Vector6 sigma = stated.diagonal().cwiseSqrt();
    if ((off.cwiseQuotient(sigma).cwiseAbs().array() > 4.0).any()) ++beyond;
  }
  // Along two axes one in four hundred each, and what is normal.
  EXPECT_LT(beyond, 0.0055 * kDraws);
  EXPECT_GT(beyond, 0.002 * kDraws);
}

}  // namespace
}  // namespace cdprcal
