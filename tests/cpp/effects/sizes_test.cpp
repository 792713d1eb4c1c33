// Sizes of effects belong to a robot: irma4's are written down, others follow from its weight and
// its lengths.
#include <gtest/gtest.h>

#include <map>

#include "../support/scaled.hpp"
#include "cdprcal/effects/catalogue.hpp"

namespace cdprcal {
namespace {

using test::scaled;

/// Exponents of mass and length in a unit; of the internal value where files have its inverse.
std::pair<double, double> dimension(const EffectInfo& info, const EffectParameter& parameter) {
  static const std::map<std::string, std::pair<double, double>> table{
      {"1", {0, 0}},      {"s", {0, 0}},    {"rad", {0, 0}}, {"rad/s", {0, 0}},
      {"rad/m", {0, -1}}, {"m", {0, 1}},    {"kg", {1, 0}},  {"kg/m", {1, -1}},
      {"N", {1, 0}},      {"N/m", {1, -1}}, {"N/s", {1, 0}}, {"Ns/m", {1, 0}}};
  auto out = table.at(parameter.unit);
  if (info.inverse) out = {-out.first, -out.second};
  return out;
}

TEST(Sizes, GrowWithTheRobotAsTheirUnitDoes) {
  const Robot robot = load_robot("irma4");
  constexpr double kMass = 5.0, kLength = 1.7;
  const Robot other = scaled(robot, {kMass, kLength});
  for (const auto& effect : effect_catalogue()) {
    SCOPED_TRACE(effect->name());
    const EffectValues typical = effect->typical(robot), larger = effect->typical(other);
    const EffectValues most = effect->plausible(robot), larger_most = effect->plausible(other);
    ASSERT_EQ(larger.size(), typical.size());
    Eigen::Index k = 0;
    for (const EffectParameter& parameter : effect->info().parameters) {
      const auto [mass, length] = dimension(effect->info(), parameter);
      const double factor = std::pow(kMass, mass) * std::pow(kLength, length);
      for (int i = 0; i < entries(parameter.shape, 4); ++i, ++k) {
        EXPECT_NEAR(larger[k], factor * typical[k], 1e-12 * larger[k]) << parameter.name;
        EXPECT_NEAR(larger_most[k], factor * most[k], 1e-12 * larger_most[k]) << parameter.name;
      }
    }
  }
}

TEST(Sizes, OfIrma4AreThoseOfTheTable) {
  const Robot robot = load_robot("irma4");
  for (const auto& effect : effect_catalogue()) {
    SCOPED_TRACE(effect->name());
    const EffectValues typical = effect->typical(robot), most = effect->plausible(robot);
    Eigen::Index k = 0;
    for (const EffectParameter& parameter : effect->info().parameters) {
      for (int i = 0; i < entries(parameter.shape, 4); ++i, ++k) {
        EXPECT_DOUBLE_EQ(typical[k], parameter.typical) << parameter.name;
        EXPECT_DOUBLE_EQ(most[k], parameter.plausible) << parameter.name;
      }
    }
  }
}

TEST(Sizes, OfEyeletsAreThoseOfPulleysInTheFrame) {
  Robot robot = scaled(load_robot("irma4"), {1.0, 2.0});
  for (Cable& cable : robot.cables) cable.pulley.radius_m = 0.0;
  const auto effect = find_effect("pulley_radius");
  EXPECT_NEAR(effect->typical(robot)[0], 2.0 * effect->info().parameters[0].typical, 1e-12);
}

}  // namespace
}  // namespace cdprcal
