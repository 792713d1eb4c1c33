#include "cdprcal/robot_file/robot_file.hpp"

#include <gtest/gtest.h>

#include <ctime>
#include <filesystem>
#include <fstream>

#include "../support/damaged.hpp"
#include "../support/random_robot.hpp"
#include "cdprcal/error.hpp"
#include "support/refusal.hpp"

namespace cdprcal {
namespace {

using test::Rng;

std::string irma4_with(const std::string& old_text, const std::string& new_text) {
  std::string yaml = builtin_robot_yaml("irma4");
  const std::size_t at = yaml.find(old_text);
  EXPECT_NE(at, std::string::npos) << old_text;
  return yaml.replace(at, old_text.size(), new_text);
}

std::string message_of(const std::string& yaml) {
  return test::refusal_of([&] { parse_robot(yaml, "robot.yaml"); });
}

/// The text is refused in a message that starts with "robot.yaml:<place> " and holds `problem`.
void expect_refused(const std::string& yaml, const std::string& place, const std::string& problem) {
  const std::string message = message_of(yaml);
  EXPECT_EQ(message.rfind("robot.yaml:" + place, 0), 0U) << message;
  EXPECT_NE(message.find(problem), std::string::npos) << message;
}

std::string repeat(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

void expect_same(const Robot& a, const Robot& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.gravity_m_s2, b.gravity_m_s2);
  EXPECT_EQ(a.platform.mass_kg, b.platform.mass_kg);
  EXPECT_EQ(a.platform.centre_of_mass_m, b.platform.centre_of_mass_m);
  EXPECT_EQ(a.platform.inertia_kg_m2, b.platform.inertia_kg_m2);
  EXPECT_EQ(a.platform.motion, b.platform.motion);
  EXPECT_EQ(a.platform.motion_plane_normal, b.platform.motion_plane_normal);
  ASSERT_EQ(a.cable_count(), b.cable_count());
  for (std::size_t i = 0; i < a.cables.size(); ++i) {
    EXPECT_EQ(a.cables[i].pulley.radius_m, b.cables[i].pulley.radius_m);
    EXPECT_EQ(a.cables[i].pulley.position_m, b.cables[i].pulley.position_m);
    EXPECT_EQ(a.cables[i].pulley.axes_world, b.cables[i].pulley.axes_world);
    EXPECT_EQ(a.cables[i].platform_anchor_m, b.cables[i].platform_anchor_m);
    const Vector3 &known = a.cables[i].pulley.position_sigma_m,
                  &again = b.cables[i].pulley.position_sigma_m;
    EXPECT_TRUE(known == again || (known.hasNaN() && again.hasNaN()));
  }
  EXPECT_EQ(a.platform.outline_m, b.platform.outline_m);
  EXPECT_EQ(a.surroundings.floor_m, b.surroundings.floor_m);
  EXPECT_EQ(a.surroundings.length_min_m, b.surroundings.length_min_m);
  EXPECT_EQ(a.surroundings.length_max_m, b.surroundings.length_max_m);
  ASSERT_EQ(a.surroundings.keep_out.size(), b.surroundings.keep_out.size());
  for (std::size_t i = 0; i < a.surroundings.keep_out.size(); ++i) {
    EXPECT_EQ(a.surroundings.keep_out[i].lower_m, b.surroundings.keep_out[i].lower_m);
    EXPECT_EQ(a.surroundings.keep_out[i].upper_m, b.surroundings.keep_out[i].upper_m);
  }
  EXPECT_EQ(a.tension_min_N, b.tension_min_N);
  EXPECT_EQ(a.tension_max_N, b.tension_max_N);
  EXPECT_EQ(a.euler_convention, b.euler_convention);
  EXPECT_EQ(a.sigma.length_m, b.sigma.length_m);
  EXPECT_EQ(a.sigma.swivel_rad, b.sigma.swivel_rad);
  EXPECT_EQ(a.sigma.attitude_rad, b.sigma.attitude_rad);
  EXPECT_EQ(a.sigma.tension_N, b.sigma.tension_N);
  EXPECT_EQ(a.sigma.wrench_force_N, b.sigma.wrench_force_N);
  EXPECT_EQ(a.sigma.wrench_moment_Nm, b.sigma.wrench_moment_Nm);
}

TEST(RobotFile, Irma4IsTable1) {
  const Robot robot = load_robot("irma4");
  ASSERT_EQ(robot.cable_count(), 4);
  EXPECT_EQ(robot.name, "irma4");
  EXPECT_EQ(robot.gravity_m_s2, 9.81);
  EXPECT_EQ(robot.platform.mass_kg, 12.992);
  EXPECT_EQ(robot.platform.centre_of_mass_m, Vector3(0.0, 0.0, 0.173));
  const Vector3 i(1, 0, 0), j(0, 1, 0), k(0, 0, 1);
  const Vector3 d[4] = {{1.065, -1.155, 1.839},
                        {1.066, 1.155, 1.839},
                        {-1.066, 1.155, 1.839},
                        {-1.065, -1.155, 1.839}};
  const Vector3 a[4] = {{0.075, -0.075, 0.266},
                        {0.075, 0.075, 0.266},
                        {-0.075, 0.075, 0.266},
                        {-0.075, -0.075, 0.266}};
  const Vector3 y[4] = {j, j, -j, -j};
  const Vector3 z[4] = {i, i, -i, -i};
  for (std::size_t c = 0; c < 4; ++c) {
    const Cable& cable = robot.cables[c];
    EXPECT_EQ(cable.pulley.radius_m, 0.03);
    EXPECT_EQ(cable.pulley.position_m, d[c]);
    EXPECT_EQ(cable.platform_anchor_m, a[c]);
    EXPECT_EQ(cable.pulley.x_axis(), -k);
    EXPECT_EQ(cable.pulley.y_axis(), y[c]);
    EXPECT_EQ(cable.pulley.swivel_axis(), z[c]);
  }
  EXPECT_EQ(robot.tension_min_N, 20.0);
  EXPECT_EQ(robot.tension_max_N, 400.0);
  EXPECT_EQ(robot.euler_convention, EulerConvention::XYZ);
  EXPECT_EQ(robot.sigma.length_m, 0.01);  // eq. 18
  EXPECT_EQ(robot.sigma.swivel_rad, kDegree);
  EXPECT_EQ(robot.sigma.attitude_rad, 2.0 * kDegree);
  EXPECT_EQ(robot.sigma.tension_N, 10.0);
}

TEST(RobotFile, RoundTripToTheLastBit) {
  expect_same(parse_robot(to_yaml(load_robot("irma4")), "copy"), load_robot("irma4"));
  Rng rng(71);
  for (int i = 0; i < 300; ++i) {
    Robot robot = test::random_robot(rng, 1 + i % 8, i % 3 == 0);
    robot.name = i % 2 == 0 ? "quoted \"name\" \\ with: # [signs]" : "Übung é";
    robot.sigma.length_m = test::uniform(rng, 1e-4, 1e-2);
    robot.sigma.swivel_rad = test::uniform(rng, 1e-3, 1e-1);
    robot.sigma.attitude_rad = test::uniform(rng, 0.05, 5.0) * kDegree;
    if (i % 2 == 0) robot.sigma.wrench_moment_Nm = test::uniform(rng, 0.01, 1.0);
    robot.platform.motion = static_cast<Motion>(i % 4);
    if (row_of(robot.platform.motion).is_planar()) {
      robot.platform.motion_plane_normal =
          test::uniform_vector(rng, Vector3::Constant(0.1), Vector3::Constant(1.0));
      finalise(robot);
    }
    if (i % 5 == 0) robot.cables[0].pulley.position_sigma_m.setConstant(0.5);
    if (i % 7 == 0) robot.cables[0].pulley.position_sigma_m = Vector3(0.1, 2.0, 3.0);
    if (i % 3 == 0) robot.surroundings.floor_m = test::uniform(rng, -1.0, 1.0);
    if (i % 4 == 0) robot.surroundings.length_min_m = test::uniform(rng, 0.0, 1.0);
    if (i % 8 == 0) robot.surroundings.length_max_m = test::uniform(rng, 1.0, 9.0);
    for (int k = 0; k < i % 3; ++k) {
      const Vector3 corner = test::uniform_vector(rng, -Vector3::Ones(), Vector3::Ones());
      robot.platform.outline_m.push_back(corner);
      robot.surroundings.keep_out.push_back({corner, corner + Vector3::Constant(0.1)});
    }
    expect_same(parse_robot(to_yaml(robot), "copy"), robot);
  }
}

TEST(RobotFile, DerivedSigmaStaysDerivedInTheFile) {
  EXPECT_EQ(to_yaml(load_robot("irma4")).find("wrench"), std::string::npos);
  const std::string given = irma4_with("tension_N: 10}", "tension_N: 10, wrench_force_N: 0.7}");
  EXPECT_EQ(parse_robot(given, "").sigma.wrench_force_N, 0.7);
  EXPECT_NE(to_yaml(parse_robot(given, "")).find("wrench_force_N: 0.7"), std::string::npos);
}

TEST(RobotFile, OptionalKeysHaveTheDocumentedDefaults) {
  std::string yaml = irma4_with("gravity_m_s2: 9.81\n", "");
  yaml.resize(yaml.find("sensors:"));
  expect_same(parse_robot(yaml, "short"), load_robot("irma4"));
  EXPECT_EQ(parse_robot(irma4_with("swivel_deg: 1,", "swivel_rad: 0.25,"), "").sigma.swivel_rad,
            0.25);
}

TEST(RobotFile, KeysUnknownDuplicateOrMissing) {
  expect_refused(irma4_with("mass_kg", "mass"), "5:3: platform.mass: ", "did you mean mass_kg?");
  expect_refused(irma4_with("gravity_m_s2: 9.81", "colour: red"),
                 "3:1: colour: ", "unknown key; known here: name, gravity_m_s2");
  expect_refused(irma4_with("radius_m: 0.03", "radius_m: 0.03, <<: {}"), "9:", "<<");
  expect_refused(irma4_with("gravity_m_s2: 9.81", "gravity_m_s2: 9.81\ngravity_m_s2: 9.80"),
                 "4:1: gravity_m_s2: ", "given twice");
  expect_refused(irma4_with("radius_m: 0.03,", "radius_m: 0.03, radius_m: 0.04,"),
                 "9:30: cables[#1].pulley.radius_m: ", "given twice");
  expect_refused(irma4_with("swivel_deg: 1,", "swivel_deg: 1, swivel_rad: 0.1,"),
                 "20:", "in degrees too");
  for (const auto& [line, field] : std::vector<std::pair<std::string, std::string>>{
           {"name: irma4\n", "name"},
           {"  mass_kg: 12.992\n", "platform.mass_kg"},
           {"  centre_of_mass_m: [0, 0, 0.173]\n", "platform.centre_of_mass_m"},
           {"radius_m: 0.03, ", "cables[#1].pulley.radius_m"},
           {", swivel_axis: [1, 0, 0]", "cables[#1].pulley.swivel_axis"},
           {"x_axis: [0, 0, -1], ", "cables[#1].pulley.x_axis"},
           {"    platform_anchor_m: [0.075, -0.075, 0.266]\n", "cables[#1].platform_anchor_m"},
           {"tension_limits_N: [20, 400]\n", "tension_limits_N"}}) {
    expect_refused(irma4_with(line, ""), "", field + ": is missing");
  }
}

TEST(RobotFile, ValuesOfTheWrongKind) {
  const std::string place = "5:12: platform.mass_kg: ";
  for (const char* bad : {"heavy", "'12'", "12,5", "1e999", "0x10", "12 kg", "[12]", "{a: 1}",
                          ".nan", ".inf", "-.inf", "nan", "inf", "1_000", "--1", "+", "true"}) {
    expect_refused(irma4_with("mass_kg: 12.992", std::string("mass_kg: ") + bad), place, "");
  }
  expect_refused(irma4_with("mass_kg: 12.992", "mass_kg:"), "5:3: platform.mass_kg: ", "empty");
  for (const char* good : {"+12.992", "12992e-3", "1.2992e+1"}) {
    EXPECT_EQ(parse_robot(irma4_with("mass_kg: 12.992", std::string("mass_kg: ") + good), "")
                  .platform.mass_kg,
              12.992);
  }
  expect_refused(irma4_with("[1.065, -1.155, 1.839]", "[1.065, -1.155]"),
                 "9:42: cables[#1].pulley.position_m: ", "3 numbers, but has 2");
  expect_refused(irma4_with("[1.065, -1.155, 1.839]", "1.065"), "9:42: ", "a list of 3 numbers");
  expect_refused(irma4_with("[1.065, -1.155, 1.839]", "[1.065, x, 1.839]"),
                 "9:50: cables[#1].pulley.position_m[#2]: ", "'x'");
  expect_refused(irma4_with(", [0, 0, 0.18643]]", "]"),
                 "7:18: platform.inertia_kg_m2: ", "three rows");
  expect_refused(irma4_with("[20, 400]", "[20, 200, 400]"),
                 "17:19: tension_limits_N: ", "2 numbers");
  expect_refused(irma4_with("convention: XYZ", "convention: xyz"),
                 "19:21: sensors.euler_convention", "ZYX");
  expect_refused(irma4_with("name: irma4", "name: [a]"), "2:7: name: ", "must be text");
  expect_refused("name: x\nplatform: 3\ncables: []\ntension_limits_N: [0, 1]\n",
                 "2:11: platform: ", "must be a mapping");
}

TEST(RobotFile, ValuesThatMakeNoRobotPointAtTheirLine) {
  expect_refused(irma4_with("mass_kg: 12.992", "mass_kg: -1"),
                 "5:12: platform.mass_kg: ", "must be positive, not -1");
  expect_refused(irma4_with("x_axis: [0, 0, -1]", "x_axis: [0, 0, 0]"),
                 "9:74: cables[#1].pulley.x_axis: ", "is zero");
  expect_refused(irma4_with("swivel_axis: [-1, 0, 0]", "swivel_axis: [0, 0, 0]"),
                 "13:", "cables[#3].pulley.swivel_axis: is zero");
  expect_refused(irma4_with("[20, 400]", "[400, 20]"), "17:19: tension_limits_N: ", "minimum");
  expect_refused(irma4_with("[0, 0.11545, 0]", "[0, -0.11545, 0]"),
                 "7:18: platform.inertia_kg_m2: ", "positive definite");
  expect_refused(irma4_with("length_m: 0.01", "length_m: 0"), "20:", "sensors.sigma.length_m: ");
  std::string many = builtin_robot_yaml("irma4");
  const std::size_t begin = many.find("  - pulley"), end = many.find("tension_limits_N");
  const std::string four = many.substr(begin, end - begin);
  EXPECT_EQ(parse_robot(std::string(many).insert(begin, four), "").cable_count(), 8);
  expect_refused(many.insert(begin, four + four), "9:3: cables: ", "1 to 8 cables, not 12");
}

TEST(RobotFile, WhatIsInTheWayIsReadOrRefusedAtItsLine) {
  const auto with = [](const std::string& lines) {
    return irma4_with("tension_limits_N:", lines + "\ntension_limits_N:");
  };
  const Surroundings none = load_robot("irma4").surroundings;
  EXPECT_FALSE(none.any());
  const Surroundings around =
      parse_robot(with("floor_m: 0.1\nlength_limits_m: [0.2, 3]\nkeep_out:\n"
                       "  - {lower_m: [0, 0, 0], upper_m: [1, 2, 3]}"),
                  "")
          .surroundings;
  EXPECT_EQ(around.floor_m, 0.1);
  EXPECT_EQ(around.length_max_m, 3.0);
  ASSERT_EQ(around.keep_out.size(), 1U);
  EXPECT_EQ(around.keep_out[0].upper_m, Vector3(1, 2, 3));
  expect_refused(with("keep_out:\n  - {lower_m: [0, 0, 0], upper_m: [1, 0, 1]}"), "",
                 "keep_out[#1].lower_m: must be below upper_m");
  expect_refused(with("keep_out:\n  - {lower_m: [0, 0, 0]}"), "", "upper_m");
  expect_refused(with("length_limits_m: [3, 2]"), "",
                 "length_limits_m: must be [minimum, maximum]");
  expect_refused(with("floor_m: low"), "", "floor_m");
}

TEST(RobotFile, MotionsAndTheirPlaneAreReadOrRefusedAtTheirLine) {
  const auto with = [](const std::string& lines) {
    return irma4_with("  mass_kg: 12.992\n", "  mass_kg: 12.992\n" + lines);
  };
  EXPECT_EQ(parse_robot(with("  motion: 3T\n"), "").platform.motion, Motion::t3);
  const Robot planar = parse_robot(with("  motion: 1R2T\n  motion_plane_normal: [0, -2, 0]\n"), "");
  EXPECT_EQ(planar.platform.motion, Motion::r1t2);
  EXPECT_EQ(planar.platform.motion_plane_normal, Vector3(0, -1, 0));
  expect_refused(with("  motion: 2R2T\n"), "6:11: platform.motion: ", "3R3T, 3T, 1R2T, 2T");
  expect_refused(with("  motion: 2T\n"), "", "platform.motion_plane_normal: is missing");
  expect_refused(with("  motion: 2T\n  motion_plane_normal: [0, 0, 0]\n"),
                 "7:24: platform.motion_plane_normal: ", "is zero");
  expect_refused(with("  motion: 3T\n  motion_plane_normal: [0, 0, 1]\n"),
                 "7:24: platform.motion_plane_normal: ", "planar motions");
  const std::string known = "position_m: [1.065, -1.155, 1.839], position_sigma_m: ";
  const auto sigma = [&](const std::string& value) {
    return irma4_with("position_m: [1.065, -1.155, 1.839]", known + value);
  };
  EXPECT_TRUE(load_robot("irma4").cables[0].pulley.position_sigma_m.hasNaN());
  EXPECT_EQ(parse_robot(sigma("0.5"), "").cables[0].pulley.position_sigma_m,
            Vector3::Constant(0.5));
  EXPECT_EQ(parse_robot(sigma("[1, 2, 3]"), "").cables[0].pulley.position_sigma_m,
            Vector3(1, 2, 3));
  for (const char* bad : {"0", "-1", "[1, 2]", "x", "[1, 0, 1]"}) {
    expect_refused(sigma(bad), "9:", "cables[#1].pulley.position_sigma_m");
  }
}

TEST(RobotFile, PointsAndEyeletsNeedLess) {
  const std::string head = "name: belts\nplatform: {mass_kg: 8, motion: ";
  const std::string tail =
      "}\ncables:\n  - pulley: {radius_m: 0, position_m: [0, 0, 0]}\n"
      "  - pulley: {radius_m: 0, position_m: [3, 0, 0]}\ntension_limits_N: [0, 400]\n";
  const Robot robot = parse_robot(head + "2T, motion_plane_normal: [0, 1, 0]" + tail, "belts.yaml");
  EXPECT_EQ(robot.platform.centre_of_mass_m, Vector3::Zero());
  EXPECT_EQ(robot.cables[1].platform_anchor_m, Vector3::Zero());
  EXPECT_EQ(robot.cables[1].pulley.swivel_axis(), Vector3::UnitY());
  EXPECT_EQ(robot.cables[1].pulley.x_axis(), -Vector3::UnitX());
  expect_same(parse_robot(to_yaml(robot), "copy"), robot);
  expect_refused(head + "3R3T" + tail, "2:", "platform.centre_of_mass_m: is missing");
}

TEST(RobotFile, WhatIsNoRobotFileIsRefusedQuickly) {
  const std::clock_t start = std::clock();  // of the processor: other programs run too
  EXPECT_NE(message_of("").find("is empty"), std::string::npos);
  EXPECT_NE(message_of("\n# nothing\n").find("is empty"), std::string::npos);
  EXPECT_NE(message_of(std::string("name: \0\x01", 8)).find("binary"), std::string::npos);
  EXPECT_NE(message_of("# one\nname: R\xFC"
                       "ben")
                .find("robot.yaml:2: is not UTF-8"),
            std::string::npos);
  EXPECT_NE(message_of(repeat("x", 2'000'000)).find("250 kB"), std::string::npos);
  EXPECT_NE(message_of(repeat("[", 200'000)).find("nested"), std::string::npos);
  EXPECT_NE(message_of(repeat("- ", 100'000)).find("nested"), std::string::npos);
  EXPECT_NE(message_of(repeat("{a: ", 50'000)).find("nested"), std::string::npos);
  EXPECT_NE(message_of("just some words").find("mapping"), std::string::npos);
  EXPECT_NE(message_of("name: [1, 2").find("not YAML"), std::string::npos);
  EXPECT_NE(
      message_of(irma4_with("name: irma4", "name: irma4\n\tgravity_m_s2: 1")).find("robot.yaml:3"),
      std::string::npos);
  const std::string yaml = builtin_robot_yaml("irma4");
  expect_refused(yaml + "---\n" + yaml, "21:1: ", "second document");
  // yaml-cpp makes empty documents of these, without end.
  expect_refused(", 1e-2]]}\nname: one\n", "1:1: ", "a bracket or comma has no beginning");
  EXPECT_NE(message_of("]").find("not YAML"), std::string::npos);
  EXPECT_NE(message_of(yaml + "]\n").find("not YAML"), std::string::npos);
  EXPECT_EQ(message_of("name: \"\\\x13\"").find('\x13'), std::string::npos);
  // Every alias of this doubles what it stands for; nothing of it may be expanded.
  std::string laughs = "a: &a0 [1, 1]\n";
  for (int i = 1; i < 60; ++i) {
    const std::string last = "*a" + std::to_string(i - 1);
    laughs +=
        "b" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + last + ", " + last + "]\n";
  }
  EXPECT_NE(message_of(laughs).find("unknown key"), std::string::npos);
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  EXPECT_LT(seconds, 30.0);  // generous: sanitizers and loaded machines
}

TEST(RobotFile, AliasesStandForWhatTheyName) {
  const std::string yaml =
      irma4_with("[0, 0, -1], swivel_axis: [1", "&down [0, 0, -1], swivel_axis: [1");
  std::string aliased = yaml;
  const std::size_t second = aliased.rfind("x_axis: [0, 0, -1]");
  aliased.replace(second, std::string("x_axis: [0, 0, -1]").size(), "x_axis: *down");
  expect_same(parse_robot(aliased, ""), load_robot("irma4"));
}

TEST(RobotFile, LoadByNameOrByPath) {
  const std::filesystem::path folder =
      std::filesystem::path(::testing::TempDir()) / "cdprcal_robot_file_test";
  std::filesystem::create_directories(folder);
  const std::string path = (folder / "mine.yaml").string();
  std::ofstream(path) << irma4_with("name: irma4", "name: mine");
  EXPECT_EQ(load_robot(path).name, "mine");
  for (const std::string& bad :
       {folder.string(), (folder / "absent.yaml").string(), std::string("irma5"), std::string()}) {
    try {
      load_robot(bad);
      ADD_FAILURE() << bad;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(bad), std::string::npos);
    }
  }
  try {
    load_robot("irma5");
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("irma4"), std::string::npos);
  }
  EXPECT_THROW(builtin_robot_yaml("irma5"), InputError);
  for (const std::string& name : builtin_robot_names()) EXPECT_EQ(load_robot(name).name, name);
  std::filesystem::remove_all(folder);
}

TEST(RobotFile, WritingChecksFirst) {
  Robot robot = load_robot("irma4");
  robot.platform.mass_kg = -1.0;
  EXPECT_THROW(to_yaml(robot), InputError);
}

TEST(RobotFile, RandomDamageIsRefusedOrReadNeverAnythingElse) {
  Rng rng(72);
  const std::string yaml = builtin_robot_yaml("irma4");
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    const std::string damaged = test::damaged(yaml, rng);
    try {
      Robot robot = parse_robot(damaged, "damaged");
      finalise(robot);
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace cdprcal
