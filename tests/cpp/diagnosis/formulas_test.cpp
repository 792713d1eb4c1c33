// The grammar of laws: what it writes can be read, and the hidden law is what it finds.
#include "cdprcal/diagnosis/formulas.hpp"

#include <gtest/gtest.h>

#include <set>

#include "cdprcal/diagnosis/baseline.hpp"
#include "cdprcal/effects/text_effect.hpp"
#include "cdprcal/robot_file/effect_definitions.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/synthetic/synthetic.hpp"

namespace cdprcal {
namespace {

constexpr double kAround_m = 0.3, kOut_m = 0.004;

DiagnosisModel model_of_runout(double out_m) {
  const Robot robot = load_robot("irma4");
  SyntheticLogOptions options;
  options.noise = reading_noise(robot.sigma, 0.05);
  std::vector<Log> logs{synthetic_log(robot, default_setpoints(robot, 3, 3, 2), options).log};
  const SyntheticLog truth = synthetic_log(robot, default_setpoints(robot, 3, 3, 2), options);
  for (Eigen::Index row = 0; row < logs[0].length_m.rows(); ++row) {
    const CableVector length_m =
        platform_state(robot, truth.poses[static_cast<std::size_t>(row)]).length_m();
    logs[0].length_m.row(row).array() +=
        out_m * (2.0 * kPi / kAround_m * length_m.array() + 0.7).sin().transpose();
  }
  std::vector<std::string> left_out;
  return baseline_model(robot, logs, left_out);
}

TEST(Formulas, CanAllBeReadAndTriedOutByAnybody) {
  const DiagnosisModel model = model_of_runout(0.0);
  const std::vector<Formula> all = formula_candidates(model);
  EXPECT_GT(all.size(), 500U);
  std::set<std::string> names;
  std::size_t tried = 0;
  double probability = 0.0;
  for (const auto& [effect, log_prior] : all) {
    probability += std::exp(log_prior);
    EXPECT_TRUE(names.insert(effect->name()).second) << effect->name() << " twice";
    if (tried++ % 7 != 0) continue;
    const std::string yaml = effects_to_yaml({effect});
    EXPECT_NO_THROW((void)parse_effects(yaml, "formula")) << yaml;
  }
  EXPECT_NEAR(probability, 1.0, 1e-9);
}

TEST(Formulas, FindTheLawAndItsPeriod) {
  const DiagnosisModel model = model_of_runout(kOut_m);
  const std::vector<LikelyFormula> likely = likely_formulas(model, 4);
  ASSERT_FALSE(likely.empty());
  const CandidateScore& best = likely.front().score;
  const EffectDefinition& found = *definition_of(*best.effect);
  EXPECT_EQ(found.adds.front().to, "length_m");
  const std::size_t over = found.adds.front().formula.find(" / ");
  ASSERT_NE(over, std::string::npos) << found.adds.front().formula;
  EXPECT_NEAR(std::stod(found.adds.front().formula.substr(over + 3)), kAround_m, 0.01);
  EXPECT_GT(best.log_evidence + likely.front().log_prior, 20.0);
  const auto meant = with_meaning(best.effect, best.values);
  EXPECT_NE(std::string(meant->info().sentence).find("a drum of 4"), std::string::npos)
      << meant->info().sentence;
}

TEST(Formulas, FindAStepBetweenAnyTwoRestsAndOfAnySize) {
  const Robot robot = load_robot("irma4");
  SyntheticLogOptions options;
  options.noise = reading_noise(robot.sigma, 0.05);
  const Log clean = synthetic_log(robot, default_setpoints(robot, 3, 3, 2), options).log;
  std::vector<std::string> left_out;
  std::vector<Log> as_it_was{clean};
  const std::vector<Measurement> rests =
      baseline_model(robot, as_it_was, left_out).runs[0].measurements;
  for (const std::size_t after : {3U, 7U, 12U}) {
    for (const double size_rad : {0.01, 0.3}) {
      std::vector<Log> logs{clean};
      const double knocked_s = 0.5 * (rests[after].run_time_s + rests[after + 1].run_time_s);
      for (Eigen::Index row = 0; row < clean.sample_count(); ++row) {
        if (clean.time_s[row] > knocked_s) logs[0].roll_pitch_yaw_rad(row, 2) += size_rad;
      }
      const std::vector<LikelyFormula> likely =
          likely_formulas(baseline_model(robot, logs, left_out), 1);
      ASSERT_FALSE(likely.empty());
      const CandidateScore& best = likely[0].score;
      ASSERT_TRUE(best.effect->name().starts_with("yaw_by_time_step_at_")) << best.effect->name();
      const std::string formula = definition_of(*best.effect)->adds.front().formula;
      const double at_s = std::stod(formula.substr(formula.find("time_s - ") + 9));
      EXPECT_GT(at_s, rests[after].run_time_s);
      EXPECT_LT(at_s, rests[after + 1].run_time_s);
      EXPECT_NEAR(best.values[0], size_rad, 0.1 * size_rad);  // of a scan
    }
  }
}

TEST(Formulas, NothingIsLikelyWhereNothingIs) {
  const DiagnosisModel model = model_of_runout(0.0);
  const std::vector<LikelyFormula> likely = likely_formulas(model, 1);
  ASSERT_FALSE(likely.empty());
  EXPECT_LT(likely.front().score.log_evidence + likely.front().log_prior, 3.0);
}

}  // namespace
}  // namespace cdprcal
