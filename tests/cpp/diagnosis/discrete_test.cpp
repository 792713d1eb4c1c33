// Faults of the readings' map: what each means, and which are looked for.
#include "cdprcal/diagnosis/discrete.hpp"

#include <gtest/gtest.h>

#include "cdprcal/effects/reading_faults.hpp"
#include "cdprcal/error.hpp"
#include "run.hpp"

namespace cdprcal {
namespace {

using test::startup_log;

class Discrete : public testing::Test {
 protected:
  static const Log& clean() {
    static const Log log = startup_log(load_robot("irma4"), 0.2, 31, 0);
    return log;
  }
  Robot robot = load_robot("irma4");
  Log log = clean();
};

TEST_F(Discrete, ALogThatAgreesIsLeftAsItIs) {
  const DiscreteSearch search = find_discrete_faults(robot, log);
  EXPECT_TRUE(search.faults.empty());
  EXPECT_EQ(search.cost_before, search.cost_after);
  EXPECT_EQ(log.length_m, clean().length_m);
  EXPECT_EQ(log.swivel_rad, clean().swivel_rad);
  EXPECT_EQ(log.roll_pitch_yaw_rad, clean().roll_pitch_yaw_rad);
}

TEST_F(Discrete, SeveralFaultsAreFoundOneAfterTheOther) {
  log.length_m *= 1e3;
  log.swivel_rad.col(1) *= -1.0;
  const DiscreteSearch search = find_discrete_faults(robot, log);
  ASSERT_EQ(search.faults.size(), 2U);
  EXPECT_EQ(search.faults[0].name, "length_unit");  // the worse one first
  EXPECT_EQ(search.faults[0].parameter, "factor");
  EXPECT_EQ(search.faults[0].values, std::vector<double>{1e-3});
  EXPECT_EQ(search.faults[0].text, "the lengths are in millimetres");
  EXPECT_EQ(search.faults[1].name, "swivel_sign");
  EXPECT_EQ(search.faults[1].parameter, "sign");
  EXPECT_EQ(search.faults[1].values, (std::vector<double>{1, -1, 1, 1}));
  EXPECT_EQ(search.faults[1].text, "the swivel of cable 2 counts backwards");
  EXPECT_LT(10.0 * search.cost_after, search.cost_before);
  // What comes back reads as if nothing had been wrong.
  EXPECT_LE((log.length_m - clean().length_m).norm(), 1e-12);
  EXPECT_EQ(log.swivel_rad, clean().swivel_rad);
}

TEST_F(Discrete, AllSignsAtOnceAreOneFault) {
  log.swivel_rad *= -1.0;
  const DiscreteSearch search = find_discrete_faults(robot, log);
  ASSERT_EQ(search.faults.size(), 1U);
  EXPECT_EQ(search.faults[0].name, "swivel_sign");
  EXPECT_EQ(search.faults[0].values, (std::vector<double>{-1, -1, -1, -1}));
  EXPECT_EQ(search.faults[0].text, "the swivel of cable 1, 2, 3, 4 counts backwards");
}

TEST_F(Discrete, AllAnglesInDegreesAreOneFault) {
  log.swivel_rad /= kDegree;
  log.roll_pitch_yaw_rad /= kDegree;
  const DiscreteSearch search = find_discrete_faults(robot, log);
  ASSERT_EQ(search.faults.size(), 1U);
  EXPECT_EQ(search.faults[0].values, (std::vector<double>{kDegree, kDegree}));
  EXPECT_EQ(search.faults[0].text, "all angles are in degrees");
}

TEST_F(Discrete, SwivelsInDegreesAreOne) {
  log.swivel_rad /= kDegree;
  const DiscreteSearch search = find_discrete_faults(robot, log);
  ASSERT_EQ(search.faults.size(), 1U);
  EXPECT_EQ(search.faults[0].values, (std::vector<double>{kDegree, 1.0}));
  EXPECT_EQ(search.faults[0].text, "the swivel angles are in degrees");
}

TEST_F(Discrete, AFaultIsFoundWithoutLoadCells) {
  log.tension_N.resize(log.sample_count(), 0);
  log.tension_setpoint_N.resize(log.sample_count(), 0);
  log.length_m.col(3) *= -1.0;
  const DiscreteSearch search = find_discrete_faults(robot, log);
  ASSERT_EQ(search.faults.size(), 1U);
  EXPECT_EQ(search.faults[0].name, "length_sign");
  EXPECT_EQ(search.faults[0].values, (std::vector<double>{1, 1, 1, -1}));
}

TEST_F(Discrete, AFaultIsFoundInThreeRests) {
  SyntheticLogOptions options;
  options.noise = reading_noise(robot.sigma, 0.2);
  options.seed = 33;
  options.dwell_s = 4.0;
  options.move_s = 4.0;
  std::vector<CableVector> setpoints = default_setpoints(robot, 2, 2, 2);
  setpoints.resize(3);
  log = synthetic_log(robot, setpoints, options).log;
  log.length_m *= 1e3;
  const DiscreteSearch search = find_discrete_faults(robot, log);
  ASSERT_EQ(search.faults.size(), 1U);
  EXPECT_EQ(search.faults[0].name, "length_unit");
  EXPECT_EQ(search.faults[0].text, "the lengths are in millimetres");
}

TEST_F(Discrete, ASmallErrorIsNoFault) {
  // Far beyond what chance does, and no sign, order, unit or convention.
  log.length_m.col(0) *= 1.1;
  log.length_m.col(2) *= 0.9;
  const DiscreteSearch search = find_discrete_faults(robot, log);
  EXPECT_TRUE(search.faults.empty());
  EXPECT_GT(search.cost_before, 100.0);
  EXPECT_EQ(search.cost_before, search.cost_after);
}

TEST_F(Discrete, WhatIsListedSetsTheLogRightAsTheFaultDoes) {
  const std::vector<DiscreteFault> faults{
      {"length_sign", "sign", {1, -1, 1, -1}, ""},
      {"cable_order", "order", {2, 3, 4, 1}, "", {1, 2, 3, 4}},
      {"cable_order", "order", {2, 3, 4, 1}, ""},
      {"angle_unit", "factor", {1.0, kDegree}, ""},
  };
  for (const DiscreteFault& fault : faults) {
    SCOPED_TRACE(fault.name);
    const AppliedEffect listed = as_listed(fault);
    EXPECT_TRUE(is_reading_fault(listed.name));
    EXPECT_EQ(fault_problem(listed), "");
    EXPECT_EQ(listed.parameters.size(), fault.tension_order.empty() ? 1U : 2U);
    EXPECT_EQ(listed.parameters[0].name, fault.parameter);
    EXPECT_EQ(listed.parameters[0].values, fault.values);
    Log by_file = log, by_fault = log;
    set_right(listed, by_file);
    set_right(fault, robot, by_fault);
    EXPECT_EQ(by_file.length_m, by_fault.length_m);
    EXPECT_EQ(by_file.tension_N, by_fault.tension_N);
    EXPECT_EQ(by_file.roll_pitch_yaw_rad, by_fault.roll_pitch_yaw_rad);
    EXPECT_EQ(robot.euler_convention, load_robot("irma4").euler_convention);
  }
}

TEST_F(Discrete, TheEulerConventionIsTheRobotsAndTheLogStays) {
  set_right({"euler_convention", "convention", {5.0}, ""}, robot, log);
  EXPECT_EQ(robot.euler_convention, EulerConvention::ZYX);
  EXPECT_EQ(log.roll_pitch_yaw_rad, clean().roll_pitch_yaw_rad);
}

TEST_F(Discrete, WhatNoFaultExplainsIsNone) {
  // Some map may well lower the cost of a log that contradicts its model: not by enough.
  for (const double scale : {0.6, 1.3, 1.6}) {
    log = clean();
    log.tension_N *= scale;
    const DiscreteSearch search = find_discrete_faults(robot, log);
    EXPECT_TRUE(search.faults.empty()) << scale << " " << search.faults[0].text;
    EXPECT_EQ(log.length_m, clean().length_m);
  }
}

TEST_F(Discrete, FewSensorsThatLeaveThePoseOpenAccuseNobody) {
  for (int left_out = 1; left_out < 15; ++left_out) {
    log = clean();
    const auto without = [&](int bit, LogMatrix& group) {
      if ((left_out >> bit & 1) != 0) group.resize(log.sample_count(), 0);
    };
    without(0, log.length_m);
    without(1, log.swivel_rad);
    without(2, log.tension_N);
    without(3, log.roll_pitch_yaw_rad);
    try {
      const DiscreteSearch search = find_discrete_faults(robot, log);
      EXPECT_TRUE(search.faults.empty()) << left_out << " " << search.faults[0].text;
    } catch (const InputError&) {  // too few to find a rest
    }
  }
}

TEST(DiscreteOfFiveCables, AnyTwoExchangedAreFound) {
  Robot robot = load_robot("ring5");
  SyntheticLogOptions options;
  options.noise = reading_noise(robot.sigma, 0.2);
  options.seed = 32;
  options.dwell_s = options.move_s = 4.0;
  const Log clean = synthetic_log(robot, default_setpoints(robot, 2, 2, 2), options).log;
  for (const auto& [a, b] : {std::pair{0, 1}, std::pair{0, 4}, std::pair{3, 4}}) {
    Log log = clean;
    log.length_m.col(a).swap(log.length_m.col(b));
    log.swivel_rad.col(a).swap(log.swivel_rad.col(b));
    log.tension_N.col(a).swap(log.tension_N.col(b));
    const DiscreteSearch search = find_discrete_faults(robot, log);
    ASSERT_EQ(search.faults.size(), 1U) << a << b;
    EXPECT_EQ(search.faults[0].name, "cable_order");
    std::vector<double> order{1, 2, 3, 4, 5};
    std::swap(order[static_cast<std::size_t>(a)], order[static_cast<std::size_t>(b)]);
    EXPECT_EQ(search.faults[0].values, order);
    EXPECT_EQ(log.length_m, clean.length_m) << a << b;
    EXPECT_EQ(log.tension_N, clean.tension_N) << a << b;
  }
}

}  // namespace
}  // namespace cdprcal
