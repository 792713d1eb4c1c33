#include "cdprcal/evidence/steps.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "../support/dense.hpp"
#include "../support/numeric_jacobian.hpp"
#include "cdprcal/effects/catalogue.hpp"

namespace cdprcal::test {
namespace {

/// The step of this name that parts the first rest of run 0 from all others.
std::shared_ptr<const Effect> first(const DiagnosisModel& model, const std::string& name) {
  for (const auto& effect : step_candidates(model)) {
    if (effect->name() == name && as_step(*effect)->parts_a_rest) return effect;
  }
  return nullptr;
}

/// Two runs whose angles scatter more than their readings ripple, as a jump makes them do.
DiagnosisModel with_jumping_angles() {
  DiagnosisModel model = test::two_runs();
  for (const Channel channel : {Channel::swivel, Channel::roll_pitch}) {
    const auto c = static_cast<std::size_t>(at_rest(channel));
    model.noise[c] = 3.0 * model.floor[c];
  }
  return model;
}

/// Steps at each move of a robot of four cables: a slip and a load cell of each, and one of the
/// load.
constexpr std::size_t kAMove = 9;

TEST(Steps, AreTwoACableAndMoveAndOneOfTheLoadInTheMiddleOfEach) {
  const DiagnosisModel& model = test::two_runs();
  const Candidates steps = step_candidates(model);
  std::vector<double> middles;
  for (const DiagnosisRun& run : model.runs) {
    for (std::size_t i = 0; i + 1 < run.measurements.size(); ++i) {
      const double middle =
          0.5 * (run.measurements[i].run_time_s + run.measurements[i + 1].run_time_s);
      if (std::find(middles.begin(), middles.end(), middle) == middles.end()) {
        middles.push_back(middle);
      }
    }
  }
  std::sort(middles.begin(), middles.end());
  // And six of the first move, at which both runs are as long under way.
  ASSERT_EQ(steps.size(), kAMove * middles.size() + 6);
  for (std::size_t k = kAMove * middles.size(); k < steps.size(); ++k) {
    const Step step = *as_step(*steps[k]);
    EXPECT_TRUE(step.parts_a_rest);
    EXPECT_EQ(step.cable.has_value(), steps[k]->name() == "load_cell_shift");
    EXPECT_EQ(step.time_s, middles.front());
  }
  const auto cable_of = [](std::size_t k) { return static_cast<int>(k < 4 ? k : k - 5); };
  for (std::size_t k = 0; k < kAMove * middles.size(); ++k) {
    const std::optional<Step> step = as_step(*steps[k]);
    ASSERT_TRUE(step.has_value());
    const std::size_t kind = k % kAMove;
    const bool of_load = kind == 4;
    EXPECT_EQ(step->cable, of_load ? std::nullopt : std::optional(cable_of(kind)));
    EXPECT_FALSE(step->parts_a_rest);
    EXPECT_EQ(step->time_s, middles[k / kAMove]);
    EXPECT_EQ(steps[k]->name(), of_load    ? "load_shift"
                                : kind < 4 ? "cable_slip"
                                           : "load_cell_shift");
    EXPECT_EQ(steps[k]->info().scope, EffectScope::run);
    EXPECT_EQ(steps[k]->size(4), of_load ? 4 : 1);
  }
  EXPECT_FALSE(as_step(*find_effect("mass")).has_value());
  // Samples in motion are no rests.
  DiagnosisModel moving = model;
  for (DiagnosisRun& run : moving.runs) {
    Measurement m = run.measurements[0];
    m.kind = PoseKind::kinematic_pose;
    m.run_time_s = 7.7;
    run.measurements.push_back(m);
  }
  EXPECT_EQ(step_candidates(moving).size(), steps.size());
}

TEST(Steps, AreEffectsWithWordsForPeople) {
  const auto effect = step_candidates(test::two_runs()).front();
  const EffectInfo& info = effect->info();
  EXPECT_EQ(effect->name(), "cable_slip");
  EXPECT_EQ(effect->size(4), 1);
  EXPECT_EQ(effect->typical(load_robot("irma4"))[0],
            0.01);  // a centimetre, and not more than three decimetres
  EXPECT_EQ(effect->plausible(load_robot("irma4"))[0], 0.3);
  EXPECT_STREQ(info.equation, "dl* = dl + length_m after time_s");
  EXPECT_NE(std::string(info.sentence).find("slipped"), std::string::npos);
  EXPECT_NE(std::string(info.remedy).find("drum"), std::string::npos);
  EXPECT_NE(std::string(info.settle).find("drum"), std::string::npos);
}

TEST(Steps, AreOfKindsThatAreAllTheCandidates) {
  using Kind = std::pair<std::string, bool>;
  std::set<Kind> kinds, candidates;
  const auto kind = [](const Effect& e) {
    return Kind{e.info().sentence, as_step(e)->parts_a_rest};
  };
  const DiagnosisModel model = with_jumping_angles();
  for (const auto& step : kinds_of_steps(model.robot))
    EXPECT_TRUE(kinds.insert(kind(*step)).second);
  for (const auto& step : step_candidates(model)) candidates.insert(kind(*step));
  EXPECT_EQ(kinds, candidates);
}

TEST(Slips, ShortenWhatIsReadOfTheirCableFromThenOn) {
  const DiagnosisModel& model = test::two_runs();
  const DiagnosisRun& run = model.runs[0];
  const Candidates steps = step_candidates(model);
  const auto& effect = steps[kAMove * 2 + 3];
  const Step slip = *as_step(*effect);
  for (std::size_t i = 0; i < run.measurements.size(); ++i) {
    const Measurement& m = run.measurements[i];
    const PlatformState state = platform_state(model.robot, run.poses[i]);
    const EffectContext context{model.robot, state, run.poses[i], m};
    PoseEvaluation e;
    e.length_m = CableVector::Zero(4);
    effect->add_to_readings(context, EffectValues::Constant(1, 0.02), e);
    Eigen::MatrixXd column = Eigen::MatrixXd::Zero(17, 1);
    effect->columns(context, {}, column);
    // The cable is longer than its encoder says.
    const double expected = m.run_time_s > slip.time_s ? -0.02 : 0.0;
    EXPECT_EQ(e.length_m, CableVector(expected * Eigen::Vector4d::Unit(3)));
    EXPECT_EQ(0.02 * column, Eigen::MatrixXd(expected * Eigen::VectorXd::Unit(17, 3)));
  }
}

/// What a load that shifted at the third move adds at a rest.
Vector6 added(const DiagnosisModel& model, const Measurement& m, const Pose& pose,
              const EffectValues& change, PoseEvaluation& e) {
  const auto effect = step_candidates(model)[kAMove * 2 + 4];
  const PlatformState state = platform_state(model.robot, pose);
  e.wrench.setZero();
  e.wrench_by_twist.setZero();
  effect->add_to_readings({model.robot, state, pose, m}, change, e);
  return e.wrench;
}

TEST(LoadShifts, AreAnotherPlatformFromThenOn) {
  const DiagnosisModel& model = test::two_runs();
  const DiagnosisRun& run = model.runs[0];
  const auto effect = step_candidates(model)[kAMove * 2 + 4];
  const EffectValues change = (EffectValues(4) << 0.5, 0.01, -0.02, 0.015).finished();
  Robot later = model.robot;
  later.platform.mass_kg += 0.5;
  later.platform.centre_of_mass_m += change.tail<3>();
  int before = 0, after = 0;
  for (std::size_t i = 0; i < run.measurements.size(); ++i) {
    const Measurement& m = run.measurements[i];
    const Pose& pose = run.poses[i];
    PoseEvaluation e;
    const Vector6 wrench = added(model, m, pose, change, e);
    if (m.run_time_s < as_step(*effect)->time_s) {
      EXPECT_TRUE(wrench.isZero() && e.wrench_by_twist.isZero());
      ++before;
      continue;
    }
    ++after;
    const Vector6 expected =
        wrench_residual(later, platform_state(later, pose), m.tension_N) -
        wrench_residual(model.robot, platform_state(model.robot, pose), m.tension_N);
    EXPECT_LT((wrench - expected).norm(), 1e-9);
    const Matrix6 by_twist = e.wrench_by_twist;
    const NumericJacobian by_pose = numeric_pose_jacobian(
        [&](const Pose& at) {
          PoseEvaluation scratch;
          return Eigen::VectorXd(added(model, m, at, change, scratch));
        },
        pose, 1e-3);
    EXPECT_TRUE(jacobian_matches(by_twist, by_pose, 1e-6));
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(ReadingRows{4}.size(), 4);
    effect->columns({model.robot, platform_state(model.robot, pose), pose, m}, change, columns);
    const NumericJacobian by_value = numeric_jacobian(
        [&](const Eigen::VectorXd& x) {
          PoseEvaluation scratch;
          return Eigen::VectorXd(added(model, m, pose, x, scratch));
        },
        change, 1e-3);
    EXPECT_TRUE(jacobian_matches(columns.middleRows<6>(ReadingRows{4}.wrench()), by_value, 1e-6));
  }
  EXPECT_EQ(before, 3);
  EXPECT_GT(after, 3);
}

TEST(Contacts, BearThePlatformUntilItsFirstMove) {
  const DiagnosisModel& model = test::two_runs();
  const DiagnosisRun& run = model.runs[0];
  const std::shared_ptr<const Effect> effect = first(model, "contact");
  ASSERT_NE(effect, nullptr);
  EXPECT_EQ(as_step(*effect)->cable, std::nullopt);
  const double weight_N = model.robot.weight_N();
  EXPECT_NEAR(effect->typical(model.robot)[0], 0.15 * weight_N, 1e-9);
  EXPECT_NEAR(effect->typical(model.robot)[5],
              0.15 * weight_N * characteristic_length_m(model.robot), 1e-9);
  const EffectValues wrench = (EffectValues(6) << 3.0, -2.0, 30.0, 0.5, -0.4, 0.1).finished();
  for (std::size_t i = 0; i < run.measurements.size(); ++i) {
    const Measurement& m = run.measurements[i];
    const PlatformState state = platform_state(model.robot, run.poses[i]);
    const EffectContext context{model.robot, state, run.poses[i], m};
    PoseEvaluation e;
    e.wrench.setZero();
    effect->add_to_readings(context, wrench, e);
    EXPECT_EQ(e.wrench, Vector6(i == 0 ? Vector6(-wrench) : Vector6::Zero())) << i;
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(ReadingRows{4}.size(), 6);
    effect->columns(context, wrench, columns);
    EXPECT_EQ(Vector6(columns.middleRows<6>(ReadingRows{4}.wrench()) * wrench), e.wrench);
  }
}

TEST(Slips, OfAllCablesAreOneOfEach) {
  const DiagnosisModel& model = test::two_runs();
  const DiagnosisRun& run = model.runs[0];
  const std::shared_ptr<const Effect> effect = first(model, "cable_slip");
  ASSERT_NE(effect, nullptr);
  const EffectValues slip_m = Eigen::Vector4d(0.01, -0.02, 0.03, 0.04);
  for (std::size_t i = 0; i < run.measurements.size(); ++i) {
    const PlatformState state = platform_state(model.robot, run.poses[i]);
    const EffectContext context{model.robot, state, run.poses[i], run.measurements[i]};
    PoseEvaluation e;
    e.length_m = CableVector::Zero(4);
    effect->add_to_readings(context, slip_m, e);
    EXPECT_EQ(e.length_m, CableVector(i == 0 ? EffectValues::Zero(4) : EffectValues(-slip_m))) << i;
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(ReadingRows{4}.size(), 4);
    effect->columns(context, slip_m, columns);
    EXPECT_EQ(CableVector(columns.topRows<4>() * slip_m), e.length_m);
  }
}

TEST(Steps, BesideOneAreTheOthersOfItsTime) {
  const DiagnosisModel& model = test::two_runs();
  const Candidates steps = step_candidates(model);
  using Names = std::vector<std::string>;
  const auto names = [&](const Effect& of) {
    Names out;
    for (const auto& other : steps_beside(model, of)) out.push_back(other->name());
    return out;
  };
  // Each by how many: cable by cable, at the first move also of all cables.
  using Count = std::map<std::string, int>;
  const auto counted = [&](const Effect& of) {
    Count out;
    for (const std::string& name : names(of)) ++out[name];
    return out;
  };
  const Count first_move{
      {"cable_slip", 5}, {"contact", 1}, {"load_cell_shift", 8}, {"load_shift", 1}};
  const auto without = [](Count all, const char* name) {
    if (--all[name] == 0) all.erase(name);
    return all;
  };
  EXPECT_EQ(counted(*steps[1]), without(first_move, "cable_slip"));
  EXPECT_EQ(counted(*first(model, "contact")), without(first_move, "contact"));
  EXPECT_EQ(counted(*first(model, "load_cell_shift")), without(first_move, "load_cell_shift"));
  EXPECT_EQ(counted(*steps[kAMove + 4]), (Count{{"cable_slip", 4}, {"load_cell_shift", 4}}));
}

TEST(LoadCellShifts, AreReadOfTheirCableFromTheirMoveOnOrUntilTheFirst) {
  const DiagnosisModel& model = test::two_runs();
  const DiagnosisRun& run = model.runs[0];
  const EffectValues bias_N = EffectValues::Constant(1, 7.0);
  const Candidates steps = step_candidates(model);
  for (const auto& effect : {steps[kAMove * 2 + 7], first(model, "load_cell_shift")}) {
    const Step shift = *as_step(*effect);
    EXPECT_EQ(effect->typical(load_robot("irma4")),
              find_effect("load_cell_bias")->typical(load_robot("irma4")).head(1));
    const std::string equation = effect->info().equation;
    EXPECT_NE(equation.find(shift.parts_a_rest ? "until time_s" : "after time_s"),
              std::string::npos);
    for (std::size_t i = 0; i < run.measurements.size(); ++i) {
      const Measurement& m = run.measurements[i];
      const PlatformState state = platform_state(model.robot, run.poses[i]);
      const EffectContext context{model.robot, state, run.poses[i], m};
      const bool acts = shift.parts_a_rest ? i == 0 : m.run_time_s > shift.time_s;
      CableVector tension_N = m.tension_N;
      effect->correct_tension(context, bias_N, tension_N);
      CableVector expected_N = m.tension_N;
      if (acts) expected_N[*shift.cable] -= 7.0;
      EXPECT_EQ(tension_N, expected_N) << i;
      Eigen::MatrixXd column = Eigen::MatrixXd::Zero(ReadingRows{4}.size(), 1);
      effect->columns(context, bias_N, column);
      const NumericJacobian by_value = numeric_jacobian(
          [&](const Eigen::VectorXd& x) {
            CableVector made_N = m.tension_N;
            effect->correct_tension(context, x, made_N);
            return Eigen::VectorXd(wrench_residual(model.robot, state, made_N));
          },
          bias_N, 1e-3);
      EXPECT_TRUE(jacobian_matches(column.middleRows<6>(ReadingRows{4}.wrench()), by_value, 1e-6));
    }
  }
}

TEST(Steps, OfLoadCellsAreOfRobotsThatHaveThem) {
  DiagnosisModel model = test::two_runs();
  for (DiagnosisRun& run : model.runs) {
    for (Measurement& m : run.measurements) m.tension_N.resize(0);
  }
  for (const auto& step : step_candidates(model)) EXPECT_NE(step->name(), "load_cell_shift");
}

TEST(ShiftsOfAngles, AreReadFromTheirMoveOn) {
  const DiagnosisModel model = with_jumping_angles();
  const DiagnosisRun& run = model.runs[0];
  const Candidates steps = step_candidates(model);
  const EffectValues swivel_rad = EffectValues::Constant(1, 0.03);
  const EffectValues rotation_rad = Eigen::Vector3d(0.02, -0.01, 0.03);
  const auto readings = [&](const Effect& effect, const EffectContext& context,
                            const EffectValues& values) {
    PoseEvaluation e;
    e.length_m = e.swivel_rad = CableVector::Zero(4);
    e.roll_pitch_yaw_rad =
        euler_from_rotation(context.state.rotation, model.robot.euler_convention);
    effect.add_to_readings(context, values, e);
    Eigen::VectorXd out(11);
    out << e.length_m, e.swivel_rad, e.roll_pitch_yaw_rad;
    return out;
  };
  constexpr std::size_t kAlso = 5;  // a swivel encoder of each cable, and the AHRS
  for (const std::size_t k : {(kAMove + kAlso) * 2 + 10, (kAMove + kAlso) * 2 + 13}) {
    const Effect& effect = *steps[k];
    const Step step = *as_step(effect);
    const EffectValues& values = effect.size(4) == 1 ? swivel_rad : rotation_rad;
    for (std::size_t i = 0; i < run.measurements.size(); ++i) {
      const PlatformState state = platform_state(model.robot, run.poses[i]);
      const EffectContext context{model.robot, state, run.poses[i], run.measurements[i]};
      const Eigen::VectorXd none = readings(effect, context, EffectValues::Zero(values.size()));
      const Eigen::VectorXd change = readings(effect, context, values) - none;
      EXPECT_EQ(change.isZero(1e-9), run.measurements[i].run_time_s < step.time_s) << i;
      if (step.cable) {
        EXPECT_EQ(change.norm(), std::abs(change[4 + *step.cable])) << i;
      }
      Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(ReadingRows{4}.size(), values.size());
      effect.columns(context, values, columns);
      const NumericJacobian by_value = numeric_jacobian(
          [&](const Eigen::VectorXd& x) { return readings(effect, context, x); }, values, 1e-5);
      EXPECT_TRUE(jacobian_matches(columns.topRows(11), by_value, 1e-6)) << i;
    }
  }
}

TEST(ShiftsOfAngles, AreOfRobotsThatReadThemAndOfChannelsThatScatter) {
  for (const auto& step : step_candidates(test::two_runs())) {
    EXPECT_NE(step->name(), "swivel_shift");
    EXPECT_NE(step->name(), "ahrs_shift");
  }
  DiagnosisModel model = with_jumping_angles();
  for (DiagnosisRun& run : model.runs) {
    for (Measurement& m : run.measurements) {
      m.swivel_rad.resize(0);
      m.roll_pitch_yaw_rad.setConstant(kNaN);
    }
  }
  for (const auto& step : step_candidates(model)) {
    EXPECT_NE(step->name(), "swivel_shift");
    EXPECT_NE(step->name(), "ahrs_shift");
  }
}

/// What a step that is hidden at the first move does to the pose that is found without it.
TEST(Steps, OfTheFirstMoveAreLikelyWhereTheyAre) {
  DiagnosisModel model = test::two_runs();
  const auto likely = [](const DiagnosisModel& m, const char* name, bool of_all) {
    for (const CandidateScore& score : first_step_scores(m)) {
      if (score.effect->name() != name) continue;
      if (!as_step(*score.effect)->cable == of_all) return score.log_evidence;
    }
    return kNaN;
  };
  EXPECT_LT(likely(model, "cable_slip", true), 0.0);
  EXPECT_LT(likely(model, "contact", true), 0.0);
  for (DiagnosisRun& run : model.runs) {
    for (std::size_t i = 1; i < run.measurements.size(); ++i) {
      run.measurements[i].length_m += Eigen::Vector4d(0.02, -0.015, 0.01, 0.02);
    }
  }
  ASSERT_TRUE(fit_with_noise(model));
  EXPECT_GT(likely(model, "cable_slip", true), 3.0);
}

}  // namespace
}  // namespace cdprcal::test
