// Known effects in the robot file: read, refused, written, and honoured by the calibration.
#include "cdprcal/effects/applied.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "cdprcal/calibration/calibrate.hpp"
#include "cdprcal/effects/catalogue.hpp"
#include "cdprcal/effects/schema.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/synthetic/synthetic.hpp"
#include "support/refusal.hpp"

namespace cdprcal {
namespace {

Robot with_section(const std::string& section) {
  return parse_robot(builtin_robot_yaml("irma4") + "\n" + section, "robot.yaml");
}

std::string refusal_of_effects(const std::string& section) {
  return test::refusal_of([&] { with_section(section); });
}

int lines_of(const std::string& text) {
  return static_cast<int>(std::count(text.begin(), text.end(), '\n'));
}

/// "robot.yaml:<line>:<column>: " of a place in the section, counted from the section's first line.
std::string place(int line, int column) {
  const int before = lines_of(builtin_robot_yaml("irma4")) + 1;
  return "robot.yaml:" + std::to_string(before + line) + ":" + std::to_string(column) + ": ";
}

TEST(AppliedEffects, EveryEffectOfTheCatalogueGoesThroughTheFileToTheBit) {
  const Robot plain = load_robot("irma4");
  Robot robot = plain;
  RandomNormal random(5);
  for (const auto& effect : effect_catalogue()) {
    EffectValues values = effect->typical(plain);
    for (double& v : values) v *= 0.1 + random.uniform();
    robot.effects.push_back(applied_effect(*effect, effect->to_reported(values), 4));
    if (effect->info().scope == EffectScope::run) robot.effects.back().run = "a \"b\" \\ c.csv";
  }
  robot.effects.push_back({"length_sign", "", {{"sign", {1, -1, -1, 1}}}});
  robot.effects.push_back({"swivel_sign", "run 1.csv", {{"sign", {-1, 1, 1, 1}}}});
  robot.effects.push_back({"cable_order", "", {{"order", {2, 1, 4, 3}}}});
  robot.effects.push_back({"length_unit", "", {{"factor", {1e-3}}}});
  robot.effects.push_back({"angle_unit", "", {{"factor", {1.0, kDegree}}}});
  robot.effects.push_back({"tension_unit", "", {{"factor", {9.80665}}}});
  robot.effects.push_back({"length_factor", "", {{"factor", {1, 1e-3, 1, 1}}}});
  robot.effects.push_back({"swivel_factor", "", {{"factor", {kDegree, 1, 1, 1}}}});
  robot.effects.push_back({"tension_factor", "", {{"factor", {1, 1, 9.80665, 1}}}});
  robot.effects.push_back({"tension_sign", "", {{"sign", {1, -1, 1, 1}}}});
  robot.effects.push_back({"tension_offset", "", {{"offset_N", {20, 1.0 / 3.0, 0, -7}}}});
  robot.effects.push_back({"attitude_sign", "", {{"sign", {1, -1, -1}}}});
  robot.effects.push_back({"attitude_mounting", "", {{"rotation_rad", {kPi, 0.1, 0}}}});
  robot.effects.push_back({"attitude_offset", "", {{"offset_rad", {0.1, -0.2, 3.0}}}});
  robot.effects.push_back({"whole_length_offset", "", {{"offset_m", {0.1, 0, -0.2, 1.0 / 3.0}}}});
  robot.effects.push_back({"whole_length_scale", "", {{"ratio_error", {0.01, 0, -0.02, 1e-3}}}});
  robot.effects.push_back({"whole_length_stretch", "", {{"axial_stiffness_N", {5e4}}}});
  finalise(robot);
  const Robot read = parse_robot(to_yaml(robot), "written");
  ASSERT_EQ(read.effects.size(), effect_layouts().size());
  for (std::size_t i = 0; i < read.effects.size(); ++i) {
    EXPECT_EQ(read.effects[i].name, robot.effects[i].name);
    EXPECT_EQ(read.effects[i].run, robot.effects[i].run);
    ASSERT_EQ(read.effects[i].parameters.size(), robot.effects[i].parameters.size());
    for (std::size_t p = 0; p < read.effects[i].parameters.size(); ++p) {
      EXPECT_EQ(read.effects[i].parameters[p].name, robot.effects[i].parameters[p].name);
      EXPECT_EQ(read.effects[i].parameters[p].values, robot.effects[i].parameters[p].values);
    }
  }
}

TEST(AppliedEffects, MistakesAreRefusedAtTheirPlace) {
  const auto expect = [](const std::string& section, int line, int column,
                         const std::string& what) {
    const std::string message = refusal_of_effects("effects:\n" + section);
    EXPECT_EQ(message.rfind(place(line + 1, column), 0), 0U) << message;
    EXPECT_NE(message.find(what), std::string::npos) << message;
  };
  expect("  - name: load_cell_boas\n    bias_N: [1, 2, 3, 4]\n", 1, 11, "unknown effect");
  expect("  - name: load_cell_bias\n    bias: [1, 2, 3, 4]\n", 2, 5, "did you mean bias_N");
  expect("  - name: load_cell_bias\n", 1, 5, "bias_N: is missing");
  expect("  - name: load_cell_bias\n    bias_N: [1, 2, 3]\n", 2, 13,
         "list of 4 numbers, but has 3");
  expect("  - name: load_cell_bias\n    bias_N: 3\n", 2, 13,
         "list of 4 numbers, not a single value");
  expect("  - name: frame_anchors\n    offset_m: [0, 0, 0, 0]\n", 2, 16, "must be a list of 3");
  expect("  - name: frame_anchors\n    offset_m: [[0, 0, 0]]\n", 2, 15, "4 lists of 3 numbers");
  expect("  - name: cable_elasticity\n    axial_stiffness_N: [1e5]\n", 2, 24, "must be a number");
  expect("  - name: cable_elasticity\n    axial_stiffness_N: 0\n", 2, 24, "impossible");
  expect("  - name: mass\n    mass_error_kg: -20\n", 2, 20, "without mass");
  expect("  - name: pulley_radius\n    radius_error_m: [0, 0, 0.5, 0]\n", 2, 21, "check the unit");
  expect("  - name: length_sign\n    sign: [1, 0, 1, 1]\n", 2, 11, "1 or -1");
  expect("  - name: cable_order\n    order: [1, 2, 2, 4]\n", 2, 12, "every cable once");
  expect("  - bias_N: [1, 2, 3, 4]\n", 1, 5, "");
  EXPECT_NE(refusal_of_effects("effects: {name: mass, mass_error_kg: 1}\n").find("must be a list"),
            std::string::npos);
  EXPECT_EQ(refusal_of_effects("effects: []\n"), "accepted");
  // The robot may have been changed between two logs.
  EXPECT_EQ(refusal_of_effects("effects:\n  - name: mass\n    run: a.csv\n    mass_error_kg: 1\n"),
            "accepted");
}

TEST(AppliedEffects, AreCheckedOnRobotsMadeByHandToo) {
  Robot robot = load_robot("irma4");
  robot.effects = {{"load_cell_bias", "", {{"bias_N", {1, 2, 3}}}}};
  EXPECT_THROW(check_effects(robot), InputError);
  robot.effects = {{"load_cell_bias", "", {{"bias_N", {1, 2, 3, kNaN}}}}};
  EXPECT_THROW(check_effects(robot), InputError);
  robot.effects = {{"load_cell_bias", "", {{"bias_N", {1, 2, 3, 4}}, {"gain", {1}}}}};
  EXPECT_THROW(check_effects(robot), InputError);
  robot.effects = {{"load_cell_bias", "", {{"bias_N", {1, 2, 3, 4}}}}};
  EXPECT_NO_THROW(check_effects(robot));
}

TEST(AppliedEffects, ReportedUnitsAreTurnedIntoInternalOnes) {
  const Robot robot = with_section("effects: [{name: cable_elasticity, axial_stiffness_N: 80000}]");
  const ActiveEffects active = resolve_effects(robot, "any");
  ASSERT_EQ(active.size(), 1U);
  EXPECT_DOUBLE_EQ(active[0].values[0], 1.0 / 80000.0);
  const AppliedEffect back =
      applied_effect(*active[0].effect, active[0].effect->to_reported(active[0].values), 4);
  EXPECT_DOUBLE_EQ(back.parameters.at(0).values.at(0), 80000.0);
}

TEST(AppliedEffects, OfOneRunActOnThatLogAlone) {
  const Robot robot = with_section(
      "effects:\n"
      "  - {name: yaw_drift, run: a.csv, rate_rad_s: 0.001}\n"
      "  - {name: mass, mass_error_kg: 0.5}\n");
  EXPECT_EQ(resolve_effects(robot, "/folder/a.csv").size(), 2U);
  EXPECT_EQ(resolve_effects(robot, "a.csv").size(), 2U);
  EXPECT_EQ(resolve_effects(robot, "b.csv").size(), 1U);
}

TEST(RunNames, TellTheLogsApartWithAsFewFoldersAsThatTakes) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(run_names({"/logs/a/x.csv", "/logs/b/x.csv", "y.csv"}),
            (Names{"a/x.csv", "b/x.csv", "y.csv"}));
  EXPECT_EQ(run_names({"/1/a/x.csv", "/2/a/x.csv"}), (Names{"1/a/x.csv", "2/a/x.csv"}));
  EXPECT_EQ(run_names({"/a/x.csv", "b/x.csv"}), (Names{"a/x.csv", "b/x.csv"}));
  EXPECT_EQ(run_names({"C:\\a\\x.csv", "C:\\b\\x.csv"}), (Names{"a\\x.csv", "b\\x.csv"}));
  EXPECT_EQ(run_names({"x.csv", "not_x.csv"}), (Names{"x.csv", "not_x.csv"}));
  EXPECT_EQ(run_names({"/a/x.csv", "/a/x.csv"}), (Names{"/a/x.csv", "/a/x.csv"})) << "the same log";
  EXPECT_EQ(run_names({}), Names{});
  // What is written for one log acts on it and on none of the others.
  const Names logs{"/logs/a/x.csv", "/logs/b/x.csv", "/logs/b/y.csv", "y"};
  const Names names = run_names(logs);
  for (std::size_t i = 0; i < logs.size(); ++i) {
    Robot robot = load_robot("irma4");
    robot.effects = {{"yaw_drift", names[i], {{"rate_rad_s", {0.001}}}}};
    for (std::size_t j = 0; j < logs.size(); ++j) {
      EXPECT_EQ(resolve_effects(robot, logs[j]).size(), i == j ? 1U : 0U) << names[i] << logs[j];
    }
  }
}

TEST(KnownState, IsTheLogWithoutWhatTheRobotsLoadCellsAndMapsAddToIt) {
  // Two segments; the drift counts from the first sample of the last, which is the run.
  RandomNormal random(4);
  Log clean;
  clean.source = "folder/a.csv";
  constexpr Eigen::Index kRows = 40;
  clean.time_s = Eigen::VectorXd::LinSpaced(kRows, 5.0, 5.0 + 0.1 * (kRows - 1));
  clean.time_s.tail(30).array() += 100.0;
  const double start_s = clean.time_s[10];
  for (LogMatrix* m : {&clean.length_m, &clean.swivel_rad, &clean.tension_N}) {
    m->resize(kRows, 4);
    for (double& v : m->reshaped()) v = 100.0 + random();
  }
  const Robot robot = with_section(
      "effects:\n"
      "  - {name: load_cell_bias, bias_N: [5, -3, 0, 8]}\n"
      "  - {name: load_cell_drift, run: a.csv, rate_N_s: 0.4}\n"
      "  - {name: load_cell_drift, run: b.csv, rate_N_s: 0.6}\n"
      "  - {name: length_sign, sign: [1, -1, 1, -1]}\n"
      "  - {name: pulley_friction, coefficient: 0.04}\n"
      "  - {name: mass, mass_error_kg: 0.5}\n");
  Log read = clean;
  for (Eigen::Index row = 0; row < kRows; ++row) {
    read.tension_N.row(row) += Eigen::RowVector4d(5, -3, 0, 8);
    read.tension_N.row(row).array() += 0.4 * (clean.time_s[row] - start_s);
  }
  read.length_m.col(1) *= -1.0;
  read.length_m.col(3) *= -1.0;
  const KnownState known = with_known_effects(robot, read);
  EXPECT_LT((known.log.tension_N - clean.tension_N).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_EQ(known.log.length_m, clean.length_m);
  EXPECT_EQ(known.log.swivel_rad, clean.swivel_rad);
  EXPECT_NEAR(known.robot.platform.mass_kg, robot.platform.mass_kg + 0.5, 1e-12);
  EXPECT_TRUE(known.robot.effects.empty());
  // Once more it changes nothing.
  const KnownState again = with_known_effects(known.robot, known.log);
  EXPECT_EQ(again.log.tension_N, known.log.tension_N);
  EXPECT_EQ(again.robot.platform.mass_kg, known.robot.platform.mass_kg);
}

TEST(TrueTension, ChangesWithAReadingByWhatTheCellIsOffBy) {
  const Robot robot = load_robot("irma4");
  Measurement m;
  m.tension_N = Eigen::Vector4d(60.0, 80.0, 100.0, 120.0);
  EXPECT_EQ(true_tension_by_reading(robot, {}, m), CableVector::Ones(4));
  const EffectValues gain = Eigen::Vector4d(0.1, -0.2, 0.0, 0.3);
  const ActiveEffects effects{{find_effect("load_cell_gain"), gain},
                              {find_effect("load_cell_bias"), Eigen::Vector4d(5, 6, 7, 8)}};
  const CableVector expected = (1.0 + gain.array()).inverse();
  EXPECT_LE((true_tension_by_reading(robot, effects, m) - expected).norm(), 1e-12);
}

TEST(KnownState, OfALogWithoutLoadCellsHasNone) {
  const Robot robot = with_section("effects: [{name: load_cell_bias, bias_N: [5, -3, 0, 8]}]");
  Log log;
  log.source = "a.csv";
  log.time_s = Eigen::VectorXd::LinSpaced(10, 0.0, 0.9);
  log.length_m = LogMatrix::Ones(10, 4);
  EXPECT_EQ(with_known_effects(robot, log).log.tension_N.size(), 0);
  EXPECT_EQ(with_known_effects(robot, Log{}).log.sample_count(), 0);
}

TEST(CorrectReadings, OfALogOfAnotherRobotAreRefused) {
  const Robot robot = with_section("effects: [{name: cable_order, order: [2, 1, 4, 3]}]");
  Log log;
  log.source = "three.csv";
  log.time_s = Eigen::VectorXd::LinSpaced(10, 0.0, 0.9);
  log.length_m = LogMatrix::Ones(10, 3);
  try {
    (void)correct_readings(robot, log);
    FAIL() << "a log of three cables was set right for a robot of four";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()),
              "three.csv: the log has 3 cables, robot 'irma4' has 4; give the robot file that "
              "belongs to this log");
  }
  EXPECT_FALSE(correct_readings(load_robot("irma4"), log)) << "nothing to set right";
}

TEST(ResolveEffect, NeedsItsValues) {
  EXPECT_THROW(
      (void)resolve_effect(load_robot("irma4"), {"load_cell_bias", "", {{"bias_N", {1.0, 2.0}}}}),
      InputError);
  EXPECT_THROW((void)resolve_effect(load_robot("irma4"), {"load_cell_boas", "", {}}), InputError);
}

/// A clean start-up run of irma4 and what it does to the readings.
struct CleanRun {
  Robot robot = load_robot("irma4");
  SyntheticLog made;
  CleanRun() {
    SyntheticLogOptions options;
    options.noise = reading_noise(robot.sigma, 0.02);
    options.seed = 3;
    made = synthetic_log(robot, default_setpoints(robot, 2, 2, 2), options);
  }
};

double position_error_m(const Calibration& c, const CleanRun& run) {
  EXPECT_EQ(c.result.status, CalibrationStatus::converged) << c.result.reason;
  return (c.result.poses.front().position_m - run.made.poses.front().position_m).norm();
}

TEST(AppliedEffects, TheCalibrationHonoursEachKind) {
  const CleanRun run;
  const Eigen::Index samples = run.made.log.sample_count();
  const Eigen::RowVector4d bias(14, -11, 12, -9), ratio(0.02, -0.015, 0.025, 0.01);
  struct Case {
    std::string section;
    std::function<void(Log&)> spoil;
  };
  const std::vector<Case> cases{
      {"effects: [{name: load_cell_bias, bias_N: [14, -11, 12, -9]}]",
       [&](Log& log) { log.tension_N.rowwise() += bias; }},
      {"effects: [{name: transmission_ratio, ratio_error: [0.02, -0.015, 0.025, 0.01]}]",
       [&](Log& log) { log.length_m.array().rowwise() *= 1.0 + ratio.array(); }},
      {"effects: [{name: yaw_drift, rate_rad_s: 0.002}]",
       [&](Log& log) { log.roll_pitch_yaw_rad.col(2) += 0.002 * log.time_s; }},
      {"effects: [{name: length_sign, sign: [1, -1, 1, 1]}, {name: cable_order, order: [2, 1, 3, 4]}]",
       [&](Log& log) {
         log.length_m.col(1) *= -1.0;
         for (LogMatrix* m : {&log.length_m, &log.swivel_rad, &log.tension_N}) {
           m->col(0).swap(m->col(1));
         }
         // The sign is put right first, as listed: on the channel where the reading now is.
         log.length_m.col(0) *= -1.0;
         log.length_m.col(1) *= -1.0;
       }},
      {"effects: [{name: length_unit, factor: 0.001}, {name: angle_unit, factor: [1, 0.017453292519943295]}]",
       [&](Log& log) {
         log.length_m *= 1000.0;
         log.roll_pitch_yaw_rad /= kDegree;
       }},
  };
  const double clean = position_error_m(calibrate(run.robot, run.made.log), run);
  EXPECT_LT(clean, 2e-3);
  for (const Case& c : cases) {
    Log log = run.made.log;
    ASSERT_EQ(log.sample_count(), samples);
    c.spoil(log);
    for (const Formulation formulation : {Formulation::full, Formulation::paper}) {
      CalibrateOptions options;
      options.formulation = formulation;
      options.method = Method::statics;
      EXPECT_LT(position_error_m(calibrate(with_section(c.section), log, options), run), 4e-3)
          << c.section << " " << to_string(formulation);
    }
    CalibrateOptions plain;
    plain.noise = NoiseSource::specified;  // one yardstick for both
    const double aware = calibrate(with_section(c.section), log, plain).result.cost;
    const double unaware = calibrate(run.robot, log, plain).result.cost;
    EXPECT_FALSE(unaware < 3.0 * aware) << c.section << ": the effect must matter";
  }
}

}  // namespace
}  // namespace cdprcal
