// Effects written as text: the same as compiled ones, and refused where they make no sense.
#include "cdprcal/effects/text_effect.hpp"

#include <gtest/gtest.h>

#include <set>

#include "../support/random_measurement.hpp"
#include "../support/written_effects.hpp"
#include "cdprcal/effects/catalogue.hpp"
#include "cdprcal/effects/expression.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "support/refusal.hpp"

namespace cdprcal::test {
namespace {

const std::string kWritten = "written_";
const std::set<std::string> kOfFirstOrder{"ahrs_misalignment", "base_tilt"};

/// Where the value j of the compiled effect stands among those of the written one: cable by cable
/// there, parameter by parameter here.
int place_of(const Effect& compiled, int j, int cables) {
  const ParameterShape shape = compiled.info().parameters.front().shape;
  return shape == ParameterShape::per_cable_vector3 ? (j % 3) * cables + j / 3 : j;
}

class Written : public ::testing::TestWithParam<std::shared_ptr<const Effect>> {};

TEST_P(Written, AddsAndDerivesAsTheCompiledEffect) {
  const auto& written = GetParam();
  const auto compiled = find_effect(written->name().substr(kWritten.size()));
  Rng rng(7);
  int compared = 0;
  for (const RobotPose& at : derivative_cases()) {
    SCOPED_TRACE(at.label);
    const int n = at.robot.cable_count();
    const PlatformState state = platform_state(at.robot, at.pose);
    if (!state.valid || at.robot.euler_convention != EulerConvention::XYZ) continue;
    const Matrix3 rates = euler_rate_matrix(
        euler_from_rotation(state.rotation, EulerConvention::XYZ), EulerConvention::XYZ);
    if (std::abs(rates.determinant()) < 0.3) continue;
    const Measurement m = random_measurement(rng, at);
    EffectValues values = compiled->typical(at.robot);
    for (double& v : values) v *= uniform(rng, 0.1, 1.0);
    // Rotations are written to the first order.
    if (kOfFirstOrder.count(compiled->name()) > 0) values.setZero();
    ASSERT_EQ(written->size(n), compiled->size(n));
    EffectValues same(values.size());
    for (int j = 0; j < values.size(); ++j) same[place_of(*compiled, j, n)] = values[j];

    PoseEvaluation plain, a, b;
    evaluate_pose(with_effects(at.robot, {{compiled, values}}), m, at.pose, StaticsModel::wrench,
                  {}, {{compiled, values}}, true, a);
    evaluate_pose(with_effects(at.robot, {{written, same}}), m, at.pose, StaticsModel::wrench, {},
                  {{written, same}}, true, b);
    ASSERT_TRUE(a.valid && b.valid);
    EXPECT_LT((a.length_m - b.length_m).norm(), 1e-12);
    EXPECT_LT((a.swivel_rad - b.swivel_rad).norm(), 1e-12);
    EXPECT_LT((a.roll_pitch_yaw_rad - b.roll_pitch_yaw_rad).norm(), 1e-12);
    EXPECT_LT((a.tension_N - b.tension_N).norm(), 1e-9);
    EXPECT_LT((a.wrench - b.wrench).norm(), 1e-9);
    EXPECT_LT((a.length_by_twist - b.length_by_twist).norm(), 1e-9);
    EXPECT_LT((a.swivel_by_twist - b.swivel_by_twist).norm(), 1e-9);
    EXPECT_LT((a.attitude_by_twist - b.attitude_by_twist).norm(), 1e-9);
    EXPECT_LT((a.wrench_by_twist - b.wrench_by_twist).norm(),
              1e-9 * (1.0 + a.wrench_by_twist.norm()));

    const Robot changed = with_effects(at.robot, {{compiled, values}});
    const PlatformState there = platform_state(changed, at.pose);
    const EffectContext context{changed, there, at.pose, m};
    Eigen::MatrixXd of_compiled = Eigen::MatrixXd::Zero(ReadingRows{n}.size(), values.size());
    Eigen::MatrixXd of_written = of_compiled;
    compiled->columns(context, values, of_compiled);
    written->columns(context, same, of_written);
    // Formulas say nothing of an accelerometer.
    of_compiled.bottomRows(ReadingRows{n}.size() - ReadingRows{n}.specific_force()).setZero();
    for (int j = 0; j < values.size(); ++j) {
      EXPECT_LT((of_compiled.col(j) - of_written.col(place_of(*compiled, j, n))).norm(),
                1e-9 * (1.0 + of_compiled.col(j).norm()))
          << "value " << j;
    }
    ++compared;
  }
  EXPECT_GT(compared, 8);
  EXPECT_EQ(written->needs_motion(), compiled->needs_motion());
  EXPECT_EQ(written->moves_cables(), compiled->moves_cables());
  EXPECT_EQ(written->info().one_sided, compiled->info().one_sided);
  EXPECT_EQ(written->info().of_load_cells, compiled->info().of_load_cells);
  EXPECT_EQ(written->info().scope, compiled->info().scope);
}

INSTANTIATE_TEST_SUITE_P(Catalogue, Written, ::testing::ValuesIn(written_catalogue()),
                         [](const auto& info) { return info.param->name(); });

TEST(TextEffects, TheWholeCatalogueIsWritten) {
  // But what has more numbers than a formula may have, and what asks for the rate of a wrench.
  EXPECT_EQ(written_catalogue().size() + 2, effect_catalogue().size());
  EXPECT_EQ(find_effect("umbilical")->size(4), 12);
}

/// A definition with one line in the place of another.
std::string definition(const std::string& adds,
                       const std::string& parameters = "k_m: {typical: 0.1, plausible: 1}") {
  return "effect_definitions:\n  - name: mine\n    parameters:\n      " + parameters +
         "\n    adds:\n      " + adds + "\n";
}

std::string refusal(const std::string& text) {
  return refusal_of([&] { parse_effects(text, "mine.yaml"); });
}

struct Refused {
  const char* adds;
  const char* said;
};

TEST(TextEffects, AreRefusedAtTheirLineAndColumn) {
  for (const Refused& row : std::vector<Refused>{
           {"length_m: k_m * lenght_m",
            "mine.yaml:6:23: effect_definitions[#1].adds.length_m: "
            "knows no 'lenght_m' here; give one of k_m, length_m"},
           {"length_m: \"k_m * foo(time_s)\"", "mine.yaml:6:24: "},
           {"length_m: k_m * sin(time_s", "wants ')', not the end"},
           {"length_m: k_m * sin(time_s, 2)", "sin takes 1 argument(s), not 2"},
           {"length_m: k_m +",
            "mine.yaml:6:22: effect_definitions[#1].adds.length_m: wants a term, not the end"},
           {"length_m: k_m k_m", "wants an operator or the end, not 'k_m'"},
           {"length_m: 1 + k_m", "must be 0 where all parameters are 0"},
           {"length_m: k_m * log(x_m)", "is no finite number at x_m = "},
           {"lengths_m: k_m", "has no place for 'lengths_m'; give one of length_m"},
           {"yaw_rad: k_m * length_m", "length_m is a cable's, and this belongs to none"},
           {"mass_kg: k_m * time_s", "changes the robot itself, which time_s cannot do"},
           {"mass_kg: __import__", "knows no '__import__' here"},
           {"length_m: k_m * floor(1e6 * k_m * time_s)", "jumps or bends almost everywhere"}}) {
    EXPECT_NE(refusal(definition(row.adds)).find(row.said), std::string::npos)
        << row.adds << "\n"
        << refusal(definition(row.adds));
  }
  for (const Refused& row : std::vector<Refused>{
           {"k_m: {typical: -1, plausible: 1}", "parameters.k_m.typical: must be positive"},
           {"k_m: {typical: 2, plausible: 1}", "must be at least as large as typical"},
           {"k_m: {typical: 1, plausible: 1, per: drum}", "must be common or cable, not 'drum'"},
           {"time_s: {typical: 1, plausible: 1}", "means something else; take another name"},
           {"k_m: {typical: 1, plausible: 1}\n      q: {typical: 1, plausible: 1}",
            "parameters.q: stands in no formula; delete it"}}) {
    const std::string said = refusal(definition("length_m: k_m", row.adds));
    EXPECT_NE(said.find(row.said), std::string::npos) << said;
  }
  EXPECT_NE(refusal("effect_definitions:\n  - name: mass\n    parameters: {k_m: {typical: 1, "
                    "plausible: 1}}\n    adds: {length_m: k_m}\n")
                .find("mine.yaml:2:11: effect_definitions[#1].name: is the name of an effect"),
            std::string::npos);
  const std::string deep(60, '(');
  EXPECT_NE(refusal(definition("length_m: k_m * " + deep)).find("nested too deeply"),
            std::string::npos);
  EXPECT_EQ(refusal(definition("length_m: k_m * sin(2 * pi * length_m / 0.3)")), "accepted");
}

TEST(TextEffects, GoThroughTheRobotFileToTheBit) {
  Robot robot = with_own_effects(load_robot("irma4"), written_catalogue());
  robot = with_own_effects(robot, parse_effects(definition("length_m: k_m * cable"), "mine.yaml"));
  robot.effects.push_back({"mine", "", {{"k_m", {1.0 / 3.0}}}});
  const std::string yaml = to_yaml(robot);
  const Robot again = parse_robot(yaml, "again.yaml");
  EXPECT_EQ(to_yaml(again), yaml);
  ASSERT_EQ(again.own_effects.size(), robot.own_effects.size());
  EXPECT_EQ(again.effects.back().parameters.front().values, std::vector<double>{1.0 / 3.0});
  EXPECT_EQ(effects_of(again).size(), effect_catalogue().size() + robot.own_effects.size());
  EXPECT_EQ(find_effect(again, "mine")->info().equation, std::string("length_m += k_m * cable"));
  EXPECT_EQ(find_effect(again, "mine")->info().parameters.front().unit, std::string("m"));
  EXPECT_THROW((void)find_effect("mine"), InputError);
}

TEST(Expressions, HaveTheValuesAndDerivativesOfCMath) {
  const std::vector<std::string> names{"x", "y"};
  const std::array<double, 2> at{0.7, -1.9};
  const std::array<Slope, 2> slopes{Slope(at[0], 0), Slope(at[1], 1)};
  struct Row {
    const char* text;
    double value, by_x, by_y;
  };
  const double x = at[0], y = at[1];
  for (const Row& row : std::vector<Row>{
           {"x - y - 1", x - y - 1.0, 1.0, -1.0},
           {"-x^2 / y", -x * x / y, -2.0 * x / y, x * x / (y * y)},
           {"2 ^ 3 ^ 2 * x", 512.0 * x, 512.0, 0.0},
           {"y^3 + y^-2", std::pow(y, 3) + std::pow(y, -2), 0.0,
            3.0 * y * y - 2.0 * std::pow(y, -3)},
           {"atan2(x, y)", std::atan2(x, y), y / (x * x + y * y), -x / (x * x + y * y)},
           {"hypot(x, y)", std::hypot(x, y), x / std::hypot(x, y), y / std::hypot(x, y)},
           {"exp(x) * sin(y) + log1p(x)", std::exp(x) * std::sin(y) + std::log1p(x),
            std::exp(x) * std::sin(y) + 1.0 / (1.0 + x), std::exp(x) * std::cos(y)},
           {"min(x, y) + 2 * max(x, y)", y + 2.0 * x, 2.0, 1.0},
           {"rest(x, 0.3)", 0.1, 1.0, 0.0},
           {"sign(y) * step(x) * abs(y)", -std::abs(y), 0.0, 1.0},
           {"1.5e-1 * .5 * x", 0.075 * x, 0.075, 0.0}}) {
    const Expression formula(row.text, names);
    const Slope found = formula(std::span<const Slope>(slopes));
    EXPECT_NEAR(formula(std::span<const double>(at)), row.value, 1e-14) << row.text;
    EXPECT_NEAR(found.a, row.value, 1e-14) << row.text;
    EXPECT_NEAR(found.v[0], row.by_x, 1e-13) << row.text;
    EXPECT_NEAR(found.v[1], row.by_y, 1e-13) << row.text;
  }
}

}  // namespace
}  // namespace cdprcal::test
