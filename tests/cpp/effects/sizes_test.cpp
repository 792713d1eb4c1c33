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

TEST(Sizes, OfPulleysAreAsTheRobotFileSays) {
  const auto effect = find_effect("frame_anchors");
  Robot robot = load_robot("irma4");
  const EffectValues usual = effect->typical(robot), most = effect->plausible(robot);
  EXPECT_FALSE(effect->is_stated(robot));
  robot.cables[1].pulley.position_sigma_m = Vector3(0.02, 1e-4, kNaN);
  ASSERT_TRUE(effect->is_stated(robot));
  EffectValues expected = usual, expected_most = most;
  expected[3] = 0.02;
  expected[4] = 1e-4;
  expected_most[3] *= 0.02 / usual[3];  // what is said to be small may have been moved since
  EXPECT_EQ(effect->typical(robot), expected);
  EXPECT_LT((effect->plausible(robot) - expected_most).cwiseAbs().maxCoeff(), 1e-15);
  for (const auto& other : effect_catalogue()) {
    EXPECT_EQ(other->is_stated(robot), other->name() == "frame_anchors") << other->name();
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
