// The table of injectable effects: its names and sizes, and what is said about wrong ones.
#include <gmock/gmock.h>

#include "cdprcal/effects/catalogue.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/simulator/injected_effect.hpp"
#include "cdprcal/simulator/simulator.hpp"
#include "support/refusal.hpp"

namespace cdprcal::test {
namespace {

using ::testing::HasSubstr;

const InjectableEffect* row(const std::string& name) {
  for (const InjectableEffect& effect : injectable_effects()) {
    if (effect.name == name) return &effect;
  }
  return nullptr;
}

TEST(InjectableEffects, HaveEveryEffectOfTheCatalogueUnderItsNamesAndSizes) {
  for (const auto& effect : effect_catalogue()) {
    SCOPED_TRACE(effect->name());
    const InjectableEffect* found = row(effect->name());
    ASSERT_NE(found, nullptr);
    EXPECT_FALSE(found->generator_only);
    const auto& parameters = effect->info().parameters;
    ASSERT_EQ(found->parameters.size(), parameters.size());
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      EXPECT_EQ(found->parameters[i].name, parameters[i].name);
      EXPECT_EQ(found->parameters[i].shape, parameters[i].shape);
    }
  }
}

TEST(InjectableEffects, HaveTheDiscreteAndPerSampleOnesAndSomeOfTheirOwn) {
  for (const char* name :
       {"length_sign", "swivel_sign", "cable_order", "angle_unit", "length_unit", "tension_unit",
        "length_factor", "swivel_factor", "tension_factor", "attitude_sign", "euler_convention",
        "slack", "outlier", "oscillation", "cable_slip", "load_cell_shift", "load_shift"}) {
    ASSERT_NE(row(name), nullptr) << name;
    EXPECT_FALSE(row(name)->generator_only);
  }
  for (const char* name : {"bent_frame_under_load", "temperature_step", "drum_runout"}) {
    ASSERT_NE(row(name), nullptr) << name;
    EXPECT_TRUE(row(name)->generator_only);
  }
}

TEST(InjectableEffects, EveryOneFitsInThePlant) {
  const Robot robot = load_robot("irma4");
  for (const InjectableEffect& effect : injectable_effects()) {
    SCOPED_TRACE(effect.name);
    std::vector<double> values;
    for (const ParameterLayout& parameter : effect.parameters) {
      if (parameter.range == ValueRange::order) {
        values = {4, 3, 2, 1};
      } else {
        values.resize(values.size() + static_cast<std::size_t>(entries(parameter.shape, 1)), 1.0);
      }
    }
    SimulatorOptions options;
    options.effects = {{effect.name, values}};
    EXPECT_NO_THROW(plant_parameters(robot, options));
  }
}

TEST(InjectableEffects, AreParsedAndBroadcast) {
  const InjectedEffect effect = parse_injected_effect("load_cell_bias=1.5");
  EXPECT_EQ(effect.name, "load_cell_bias");
  EXPECT_EQ(expanded(effect, 3).values, (std::vector<double>{1.5, 1.5, 1.5}));
  EXPECT_EQ(expanded(parse_injected_effect("load_cell_bias=1, -2 ,+3"), 3).values,
            (std::vector<double>{1.0, -2.0, 3.0}));
  EXPECT_EQ(expanded(parse_injected_effect("frame_anchors=1,2,3"), 2).values,
            (std::vector<double>{1, 2, 3, 1, 2, 3}));
  EXPECT_EQ(expanded(parse_injected_effect("bending_hysteresis=1,0.01"), 4).values,
            (std::vector<double>{1.0, 0.01}));
  EXPECT_EQ(parse_injected_effect("euler_convention=ZYX").values, (std::vector<double>{5.0}));
  for (const char* text : {"mass=0.1", "frame_anchors=1e-300,0.30000000000000004,-3"}) {
    const InjectedEffect once = parse_injected_effect(text);
    EXPECT_EQ(parse_injected_effect(to_string(once)).values, once.values);
  }
}

TEST(InjectableEffects, WrongOnesAreRefusedWithTheRemedy) {
  const auto parse = [](const char* text) {
    return refusal_of([&] { expanded(parse_injected_effect(text), 4); });
  };
  EXPECT_THAT(parse("friction=1"), HasSubstr("pulley_friction"));  // names the known ones
  EXPECT_THAT(parse("friction=1"), HasSubstr("'friction'"));
  EXPECT_THAT(parse("load_cell_bias=1,2"), HasSubstr("bias_N [1 or n]"));
  EXPECT_THAT(parse("frame_anchors=1"), HasSubstr("offset_m [3 or n*3]"));
  EXPECT_THAT(parse("centre_of_mass=1"), HasSubstr("offset_m [3]"));
  EXPECT_THAT(parse("mass"), HasSubstr("mass=v1"));
  EXPECT_THAT(parse("mass="), HasSubstr("must be a finite number"));
  EXPECT_THAT(parse("mass=heavy"), HasSubstr("'heavy'"));
  EXPECT_THAT(parse("mass=nan"), HasSubstr("must be a finite number"));
  EXPECT_THAT(parse("mass=1,"), HasSubstr("must be a finite number"));
  EXPECT_THAT(parse("length_sign=1,1,2,1"), HasSubstr("1 or -1"));
  EXPECT_THAT(parse("cable_order=1,1,2,3"), HasSubstr("every cable once"));
  EXPECT_THAT(parse("cable_order=1"), HasSubstr("4 cables"));
  EXPECT_THAT(parse("euler_convention=XYX"), HasSubstr("XYZ"));
  EXPECT_THAT(parse("cable_elasticity=0"), HasSubstr("positive"));
  EXPECT_THAT(parse("pulley_friction=-0.1"), HasSubstr("negative"));
  EXPECT_THAT(parse("slack=1,5,0.1"), HasSubstr("1 to 4"));
  EXPECT_THAT(refusal_of([] {
                SimulatorOptions options;
                options.effects = {{"mass", {-20.0}}};
                plant_parameters(load_robot("irma4"), options);
              }),
              HasSubstr("no mass"));
}

}  // namespace
}  // namespace cdprcal::test
