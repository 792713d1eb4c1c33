// After a first fit: noise from the readings, and the readings that do not belong.
#include "cdprcal/calibration/refine.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "../support/scenario.hpp"
#include "cdprcal/effects/catalogue.hpp"

namespace cdprcal::test {
namespace {

using ::testing::HasSubstr;

constexpr double kScale = 0.05;  ///< true noise over the robot file's σ

/// Poses at the set-points and half-way between any two of them, with every kind of sensor; single
/// samples whose noise is kScale of what the robot file says.
struct Fitted {
  Scenario s;
  CalibrationResult fit;
  Signals ripple{};

  explicit Fitted(std::uint64_t seed) {
    const Robot robot = load_robot("irma4");
    std::vector<CableVector> setpoints = irma4_setpoints();
    const std::size_t corners = setpoints.size();
    for (std::size_t i = 0; i < corners; ++i) {
      for (std::size_t j = i + 1; j < corners; ++j) {
        setpoints.push_back(0.5 * (setpoints[i] + setpoints[j]));
      }
    }
    s.problem.robot = robot;
    RandomNormal random(seed);
    const ReadingOffsets offsets = random_offsets(4, random);
    const ReadingNoise noise = reading_noise(robot.sigma, kScale, true);
    for (std::size_t i = 0; i < setpoints.size(); ++i) {
      const EquilibriumResult rest = direct_from_tensions(robot, setpoints[i]);
      if (rest.status != EquilibriumStatus::found) throw std::runtime_error(rest.reason);
      s.truth.push_back(rest.pose);
      s.problem.measurements.push_back(synthetic_measurement(
          robot, rest.pose, setpoints[i], PoseKind::static_pose, offsets, noise, random));
      s.problem.measurements.back().time_s = static_cast<double>(i);
    }
    for (std::size_t c = 0; c < kChannels; ++c) {
      ripple[c].sigma = kScale * specified_noise(robot.sigma).channel[c].sigma(1);
    }
  }

  Refinement refined() {
    fit = solve(s.problem, s.truth);
    EXPECT_EQ(fit.status, CalibrationStatus::converged) << fit.reason;
    return refine(s.problem, fit, ripple);
  }
};

TEST(Refine, FindsTheNoiseThatIsThereAndLosesNoReadingOfACleanLog) {
  Fitted clean(4);
  const Refinement refined = clean.refined();
  ASSERT_EQ(refined.result.status, CalibrationStatus::converged) << refined.result.reason;
  EXPECT_TRUE(refined.gated.empty());
  ASSERT_TRUE(refined.problem.noise);
  for (std::size_t c = 0; c < kChannels; ++c) {
    const double found = refined.problem.noise->channel[c].sigma(1);
    EXPECT_GE(found, clean.ripple[c].sigma * (1.0 - 1e-12)) << "never below the ripple";
    // A bias stays from rest to rest, and what is left does not show it.
    const bool inertial = kChannelTable[c].of().is_inertial();
    const double least =
        inertial ? specified_noise(clean.s.problem.robot.sigma).channel[c].pose : 0.0;
    EXPECT_GE(found, least);
    EXPECT_LT(found, 1.5 * std::hypot(least, clean.ripple[c].sigma)) << kChannelTable[c].name;
  }
  // The claim shrinks with the noise, and holds.
  EXPECT_LT(refined.result.standard_deviation().head<3>().norm(),
            0.2 * clean.fit.standard_deviation().head<3>().norm());
  const Vector6 error = minus(refined.result.poses[0], clean.s.truth[0]);
  EXPECT_LT(error.dot(refined.result.covariance->inverse() * error), 22.5) << "χ² of 6 at 0.1 %";
  EXPECT_GE(refined.result.iterations, clean.fit.iterations);
}

TEST(Refine, LeavesOutOneWrongReadingOfEveryChannel) {
  Fitted wrong(6);
  auto& m = wrong.s.problem.measurements;
  const auto by = [&](Channel c) { return 60.0 * wrong.ripple[static_cast<std::size_t>(c)].sigma; };
  m[3].length_m[1] += by(Channel::length);
  m[7].swivel_rad[2] -= by(Channel::swivel);
  m[11].roll_pitch_yaw_rad[1] += by(Channel::roll_pitch);
  m[15].roll_pitch_yaw_rad[2] += by(Channel::yaw);
  m[19].tension_N[3] += by(Channel::balance);
  m[23].absolute_yaw_rad += by(Channel::absolute_yaw);
  m[27].direct_length_m[0] += by(Channel::direct_length);
  m[31].position_m[2] -= by(Channel::position);
  const Refinement refined = wrong.refined();
  ASSERT_EQ(refined.result.status, CalibrationStatus::converged) << refined.result.reason;
  struct Expected {
    double time_s;
    Channel channel;
    int component;
  };
  const std::vector<Expected> expected{
      {3, Channel::length, 1},         {7, Channel::swivel, 2},   {11, Channel::roll_pitch, 1},
      {15, Channel::yaw, 2},           {19, Channel::balance, 0}, {23, Channel::absolute_yaw, 0},
      {27, Channel::direct_length, 0}, {31, Channel::position, 2}};
  for (const Expected& one : expected) {
    SCOPED_TRACE(to_string(one.channel));
    const auto found =
        std::find_if(refined.gated.begin(), refined.gated.end(), [&](const GatedReading& g) {
          return g.time_s == one.time_s && g.channel == one.channel && g.component == one.component;
        });
    ASSERT_NE(found, refined.gated.end());
    EXPECT_EQ(found->reason, GatedReading::Reason::outlier);
    EXPECT_GT(found->size, 5.0);
  }
  // Hardly any of the others, of which there are 27 a pose.
  EXPECT_LT(refined.gated.size() - expected.size(), wrong.s.truth.size() * 27 / 200);
  EXPECT_TRUE(std::is_sorted(refined.gated.begin(), refined.gated.end(),
                             [](const auto& a, const auto& b) { return a.time_s < b.time_s; }));
  // Those readings are gone from the problem, their neighbours are not.
  const auto& left = refined.problem.measurements;
  EXPECT_TRUE(std::isnan(left[3].length_m[1]));
  EXPECT_TRUE(std::isnan(left[7].swivel_rad[2]));
  EXPECT_TRUE(std::isnan(left[11].roll_pitch_yaw_rad[1]));
  EXPECT_TRUE(std::isfinite(left[11].roll_pitch_yaw_rad[0]));
  EXPECT_TRUE(std::isnan(left[15].roll_pitch_yaw_rad[2]));
  EXPECT_FALSE(left[19].balance_counts) << "a balance goes as a whole";
  EXPECT_TRUE(std::isnan(left[23].absolute_yaw_rad));
  EXPECT_TRUE(std::isnan(left[27].direct_length_m[0]));
  EXPECT_TRUE(std::isnan(left[31].position_m[2]));
  // The noise is not that of the wrong ones.
  for (std::size_t c = 0; c < kChannels; ++c) {
    if (kChannelTable[c].of().is_inertial()) continue;  // no less than specified
    EXPECT_LT(refined.problem.noise->channel[c].sigma(1), 1.6 * wrong.ripple[c].sigma);
  }
}

TEST(Refine, AChannelThatIsWrongAsAWholeLosesNothing) {
  // Every third position reading off by sixty times its noise: no few outliers, but a wrong sensor.
  Fitted wrong(6);
  auto& m = wrong.s.problem.measurements;
  const double by = 60.0 * wrong.ripple[static_cast<std::size_t>(Channel::position)].sigma;
  for (std::size_t i = 0; i < m.size(); i += 3) m[i].position_m[0] += by;
  const Refinement refined = wrong.refined();
  for (const GatedReading& gated : refined.gated) EXPECT_NE(gated.channel, Channel::position);
  if (refined.problem.noise) {
    EXPECT_GT((*refined.problem.noise)[Channel::position].sigma(1),
              5.0 * wrong.ripple[static_cast<std::size_t>(Channel::position)].sigma);
  }
}

TEST(Refine, AFitThatDidNotConvergeIsLeftAsItIs) {
  Fitted clean(4);
  clean.fit = solve(clean.s.problem, clean.s.truth);
  clean.fit.status = CalibrationStatus::not_converged;
  clean.fit.reason = "as it was";
  const Refinement refined = refine(clean.s.problem, clean.fit, clean.ripple);
  EXPECT_EQ(refined.result.status, CalibrationStatus::not_converged);
  EXPECT_EQ(refined.result.reason, "as it was");
  EXPECT_FALSE(refined.problem.noise);
  EXPECT_TRUE(refined.gated.empty());
}

TEST(Refine, WhereNoFurtherFitConvergesTheLastOneStandsAndSaysSo) {
  Fitted clean(4);
  clean.fit = solve(clean.s.problem, clean.s.truth);
  SolveOptions none;
  none.max_iterations = 0;
  const Refinement refined = refine(clean.s.problem, clean.fit, clean.ripple, none);
  EXPECT_EQ(refined.result.status, CalibrationStatus::converged);
  EXPECT_EQ(refined.result.cost, clean.fit.cost);
  EXPECT_THAT(refined.result.reason, HasSubstr("the noise could not be taken from the readings"));
  EXPECT_FALSE(refined.problem.noise) << "the weights are still the specified ones";
  EXPECT_GE(refined.result.solve_time_s, clean.fit.solve_time_s) << "all attempts count";
}

/// Load cells of so much white noise, every row a reading.
Signals load_cells(double noise_N) {
  Signals out{};
  out[static_cast<std::size_t>(Channel::balance)].sigma = noise_N;
  return out;
}

TEST(GateSlack, TakesOutACableThatMayHangLooseAndTheBalanceWithIt) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.0, 1);
  auto& m = s.problem.measurements;
  for (std::size_t i = 0; i < m.size(); ++i) m[i].time_s = 2.0 * static_cast<double>(i);
  // irma4 allows 20 N: half of it is the least that counts as taut.
  m[2].tension_N[1] = 9.9;
  m[4].tension_N[0] = 10.1;
  m[5].tension_N[3] = -2.0;
  m[6].tension_N[2] = kNaN;  // not read is not slack
  const auto gated = gate_slack(s.problem, load_cells(0.1));
  ASSERT_EQ(gated.size(), 2U);
  EXPECT_EQ(gated[0].reason, GatedReading::Reason::slack);
  EXPECT_EQ(gated[0].time_s, 4.0);
  EXPECT_EQ(gated[0].component, 1);
  EXPECT_EQ(gated[0].size, 9.9);
  EXPECT_EQ(gated[1].time_s, 10.0);
  EXPECT_EQ(gated[1].component, 3);
  EXPECT_TRUE(std::isnan(m[2].length_m[1]) && std::isnan(m[2].swivel_rad[1]));
  EXPECT_TRUE(std::isfinite(m[2].length_m[0]) && std::isfinite(m[2].swivel_rad[0]));
  EXPECT_FALSE(m[2].balance_counts);
  EXPECT_TRUE(m[4].balance_counts && m[4].length_m.allFinite());
  EXPECT_TRUE(m[6].length_m.allFinite());
  EXPECT_STREQ(to_string(gated[0].reason), "slack");
  EXPECT_STREQ(to_string(GatedReading::Reason::outlier), "outlier");
}

TEST(GateSlack, DoubtsWhatItsNoiseCouldMakeOfNothingUnlessThatIsAllowed) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.0, 1);
  auto& m = s.problem.measurements;
  m[1].tension_N[0] = 14.0;  // below three times the noise of 5 N
  m[2].tension_N[0] = 14.0;
  m[2].samples = 4;  // of a mean of four: above
  m[3].tension_N[0] = 19.0;
  m[4].tension_N[0] = 21.0;  // within the limits, whatever the noise
  m[5].tension_N[0] = -11.0;
  CalibrationProblem noisy = s.problem;
  EXPECT_EQ(gate_slack(s.problem, load_cells(5.0)).size(), 2U);
  // 20 N are allowed: what noise of 10 N cannot make of them begins below -10 N. A mean of four
  // tells more.
  const auto gated = gate_slack(noisy, load_cells(10.0));
  ASSERT_EQ(gated.size(), 2U);
  EXPECT_EQ(gated[0].size, 14.0);
  EXPECT_EQ(gated[1].size, -11.0);
  // A robot that allows any tension: a hundredth of its weight.
  Scenario free = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.0, 1);
  free.problem.robot.tension_min_N = 0.0;
  free.problem.measurements[1].tension_N[0] = 0.0099 * free.problem.robot.weight_N();
  free.problem.measurements[2].tension_N[0] = 0.0101 * free.problem.robot.weight_N();
  EXPECT_EQ(gate_slack(free.problem, load_cells(0.0)).size(), 1U);
}

TEST(GateSlack, BelievesNoNoiseThatLetsCablesPush) {
  const Robot robot = load_robot("irma4");  // sigma 10 N
  Scenario s = scenario(robot, irma4_setpoints(), PoseKind::static_pose, 0.0, 1);
  auto& m = s.problem.measurements;
  m[1].tension_N[0] = -12.0;
  m[2].tension_N[1] = 5.0;
  CalibrationProblem again = s.problem;
  EXPECT_EQ(gate_slack(s.problem, load_cells(0.1)).size(), 2U);  // one may be an outlier
  again.measurements[3].tension_N[2] = -12.0;
  const auto gated = gate_slack(again, load_cells(0.1));
  ASSERT_EQ(gated.size(), 2U);
  EXPECT_EQ(gated[0].size, -12.0);
  EXPECT_EQ(gated[1].size, -12.0);
}

TEST(GateSlack, AsksWhatTheCablesCarryNotWhatKnownBiasesMakeOfIt) {
  Scenario s = scenario(load_robot("irma4"), irma4_setpoints(), PoseKind::static_pose, 0.0, 1);
  auto& m = s.problem.measurements;
  s.problem.effects = {{find_effect("load_cell_bias"), Eigen::Vector4d(-80.0, 0.0, 0.0, 30.0)}};
  for (Measurement& reading : m) reading.tension_N += Eigen::Vector4d(-80.0, 0.0, 0.0, 30.0);
  m[1].tension_N[0] = 21.0 - 80.0;
  EXPECT_TRUE(gate_slack(s.problem, load_cells(0.1)).empty());
  m[2].tension_N[3] = 5.0 + 30.0;
  const auto gated = gate_slack(s.problem, load_cells(0.1));
  ASSERT_EQ(gated.size(), 1U);
  EXPECT_EQ(gated[0].component, 3);
  EXPECT_DOUBLE_EQ(gated[0].size, 5.0);
  for (Measurement& reading : m) reading.tension_N.resize(0);  // no load cells to know about
  EXPECT_TRUE(gate_slack(s.problem, load_cells(0.1)).empty());
}

}  // namespace
}  // namespace cdprcal::test
