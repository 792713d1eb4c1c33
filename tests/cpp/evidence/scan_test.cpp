#include "cdprcal/evidence/scan.hpp"

#include <gtest/gtest.h>

#include <set>

#include "../support/run.hpp"
#include "cdprcal/diagnosis/held_out.hpp"
#include "cdprcal/diagnosis/model_residuals.hpp"

namespace cdprcal {
namespace {

/// Baseline models of a clean run and of the same run with biased load cells.
class ScanTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const Robot robot = load_robot("irma4");
    Log log = test::startup_log(robot, 0.2, 61);
    clean_ = new Diagnosis(diagnose(robot, {log}));
    log.tension_N.rowwise() += bias();
    biased_ = new Diagnosis(diagnose(robot, {log}));
  }
  static void TearDownTestSuite() {
    delete clean_;
    delete biased_;
  }
  static Eigen::RowVector4d bias() { return {10, -8, 9, -12}; }
  static Candidates at_rest() {
    Candidates candidates = effect_catalogue();
    std::erase_if(candidates, [](const auto& effect) { return effect->needs_motion(); });
    return candidates;
  }
  static inline Diagnosis* clean_ = nullptr;
  static inline Diagnosis* biased_ = nullptr;
};

TEST_F(ScanTest, ScoresEveryCandidateOnceBestFirst) {
  const auto scores = scan(biased_->baseline, at_rest());
  ASSERT_EQ(scores.size(), at_rest().size());
  std::set<std::string> names;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    names.insert(scores[i].effect->name());
    EXPECT_GT(scores[i].p_value, 0.0);
    EXPECT_LE(scores[i].p_value, 1.0);
    EXPECT_LE(scores[i].log_evidence, scores[i > 0 ? i - 1 : 0].log_evidence);
  }
  EXPECT_EQ(names.size(), scores.size());
  EXPECT_EQ(scores.front().effect->name(), "load_cell_bias");
}

TEST_F(ScanTest, IsTheSameEveryTimeAndForEverySeedInItsValues) {
  const auto a = scan(biased_->baseline, at_rest());
  const auto b = scan(biased_->baseline, at_rest());
  const auto c = scan(biased_->baseline, at_rest(), {.draws = 199, .seed = 9});
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].p_value, b[i].p_value);
    EXPECT_EQ(a[i].log_evidence, c[i].log_evidence);
    EXPECT_EQ(a[i].values, c[i].values);
  }
}

TEST_F(ScanTest, AccusesNobodyOnACleanLog) {
  EXPECT_GT(scan(clean_->baseline, at_rest()).front().p_value, 0.01);
}

TEST_F(ScanTest, AnEffectImitatesItselfAndNoShareLeavesZeroToOne) {
  const auto scores = scan(biased_->baseline, at_rest());
  const std::vector<double> shares = imitation(biased_->baseline, scores.front(), at_rest());
  for (std::size_t k = 0; k < shares.size(); ++k) {
    EXPECT_LE(shares[k], 1.0 + 1e-9);
    EXPECT_GE(shares[k], -1e-9);
    const bool itself = at_rest()[k] == scores.front().effect;
    EXPECT_GT(shares[k], itself ? 0.9 : -1e-9);
  }
}

TEST_F(ScanTest, HeldOutGainIsNothingForTheSameModelAndPositiveForTheRightOne) {
  const HeldOut same = held_out(biased_->baseline, biased_->baseline);
  EXPECT_NEAR(same.gain, 0.0, 1e-9);
  EXPECT_EQ(same.gain_error, 0.0);
  EXPECT_DOUBLE_EQ(same.before, same.after);
  const HeldOut right = held_out(biased_->baseline, biased_->model);
  EXPECT_GT(right.gain, 3.0 * right.gain_error);
  EXPECT_LT(right.after, right.before);
}

TEST_F(ScanTest, ResidualsShrinkWhereTheEffectWas) {
  const auto rms = [](const DiagnosisModel& model) {
    double sum = 0.0;
    const std::vector<ModelResidual> rows = model_residuals(model);
    EXPECT_EQ(static_cast<int>(rows.size()), model.pose_count());
    for (const ModelResidual& row : rows) sum += row.residual.tension_N.squaredNorm();
    return std::sqrt(sum / static_cast<double>(4 * rows.size()));
  };
  EXPECT_LT(rms(biased_->model), 0.5 * rms(biased_->baseline));
  EXPECT_LT(rms(biased_->model), 1.5 * rms(clean_->model));
}

TEST_F(ScanTest, AFitDoesNotRaiseTheCostAndSettles) {
  DiagnosisModel model = biased_->model;
  const double before = penalised_cost(model);
  for (Pose& pose : model.runs[0].poses) pose.position_m += Vector3(0.01, -0.01, 0.005);
  EXPECT_GT(penalised_cost(model), before);
  EXPECT_TRUE(fit(model));
  EXPECT_NEAR(penalised_cost(model), before, 1e-3 * (1.0 + before));
}

}  // namespace
}  // namespace cdprcal
