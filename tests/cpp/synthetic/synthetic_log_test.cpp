// Logs that the project makes itself: what their options say, and nothing else.
#include <gmock/gmock.h>

#include "../support/startup_scenario.hpp"
#include "cdprcal/error.hpp"
#include "support/refusal.hpp"

namespace cdprcal::test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class Synthetic : public ::testing::Test {
 protected:
  const Robot robot = load_robot("irma4");
  const std::vector<CableVector> setpoints = [this] {
    return std::vector<CableVector>{irma4_plan().setpoint_N[0], irma4_plan().setpoint_N[1],
                                    irma4_plan().setpoint_N[6]};
  }();
};

TEST_F(Synthetic, ReadingsAreThoseOfThePosesButForConstantOffsets) {
  SyntheticLogOptions options;
  options.dwell_s = 2.0;
  options.move_s = 3.0;
  options.rate_Hz = 5.0;
  options.noise = reading_noise(robot.sigma, 0.0, true);
  const SyntheticLog made = synthetic_log(robot, setpoints, options);
  const Log& log = made.log;
  ASSERT_EQ(log.sample_count(), 5 * (3 * 2 + 2 * 3) + 1);
  EXPECT_NO_THROW(validate(log));
  ASSERT_EQ(made.poses.size(), static_cast<std::size_t>(log.sample_count()));
  CableVector first_length, first_swivel;
  double first_yaw = 0.0;
  for (Eigen::Index row = 0; row < log.sample_count(); ++row) {
    const Pose& pose = made.poses[static_cast<std::size_t>(row)];
    const PlatformState state = platform_state(robot, pose);
    EXPECT_DOUBLE_EQ(log.time_s[row], 0.2 * static_cast<double>(row));
    // The tensions that were told hold the platform there, and are read.
    const CableVector tension = log.tension_N.row(row).transpose();
    EXPECT_EQ(tension, CableVector(log.tension_setpoint_N.row(row).transpose()));
    EXPECT_LT(wrench_residual(robot, state, tension).norm(), 1e-6);
    const Vector3 euler = euler_from_rotation(state.rotation, robot.euler_convention);
    const CableVector length = log.length_m.row(row).transpose() - state.length_m();
    const CableVector swivel = log.swivel_rad.row(row).transpose() - state.swivel_rad();
    const double yaw = log.roll_pitch_yaw_rad(row, 2) - euler[2];
    if (row == 0) {
      first_length = length, first_swivel = swivel, first_yaw = yaw;
      EXPECT_GT(length.norm(), 1e-3) << "nobody knows the whole length";
    }
    EXPECT_LT((length - first_length).norm(), 1e-12);
    EXPECT_LT((swivel - first_swivel).norm(), 1e-12);
    EXPECT_NEAR(wrap_angle(yaw - first_yaw), 0.0, 1e-12);
    EXPECT_NEAR(log.roll_pitch_yaw_rad(row, 0), euler[0], 1e-12);
    EXPECT_NEAR(log.roll_pitch_yaw_rad(row, 1), euler[1], 1e-12);
    EXPECT_NEAR(log.absolute_yaw_rad(row, 0), euler[2], 1e-12);
    EXPECT_LT((log.direct_length_m.row(row).transpose() - state.length_m()).norm(), 1e-12);
    EXPECT_LT((log.position_m.row(row).transpose() - pose.position_m).norm(), 1e-12);
  }
  // At the end of each dwell, and half-way through a move, where the fifth degree is half-way too.
  const auto told = [&](double time_s) -> CableVector {
    return log.tension_setpoint_N.row(static_cast<Eigen::Index>(std::lround(5.0 * time_s)));
  };
  for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(told(5.0 * static_cast<double>(k)), setpoints[k]);
  EXPECT_EQ(told(2.0), setpoints[0]);
  EXPECT_LT(minus(made.poses.back(), direct_from_tensions(robot, setpoints[2]).pose).norm(), 1e-6);
  const CableVector half = told(5.0 - 0.6) - told(2.0 + 0.6);  // a fifth of the move at either end
  const CableVector whole = setpoints[1] - setpoints[0];
  EXPECT_LT((half - (fifth_degree(0.8) - fifth_degree(0.2)) * whole).norm(), 1e-9);
}

TEST_F(Synthetic, AWrenchOnThePlatformIsInThePosesAndNotInTheNoise) {
  SyntheticLogOptions options;
  options.noise = reading_noise(robot.sigma, 0.1);
  options.dwell_s = 1.0;
  options.move_s = 1.0;
  const std::vector<CableVector> many(60, setpoints[0]);
  const SyntheticLog plain = synthetic_log(robot, many, options);
  options.wrench_force_N = 0.5;
  options.wrench_moment_Nm = 0.1;
  const SyntheticLog pulled = synthetic_log(robot, many, options);
  EXPECT_EQ(plain.log.tension_N, pulled.log.tension_N) << "the same noise";
  double force = 0.0, moment = 0.0;
  for (std::size_t k = 0; k < many.size(); ++k) {
    const Pose& pose = pulled.poses[20 * k + 5];
    const Vector6 wrench = wrench_residual(robot, platform_state(robot, pose), setpoints[0]);
    EXPECT_LT(minus(pose, pulled.poses[20 * k + 9]).norm(), 1e-9) << "the same for all of a dwell";
    force += wrench.head<3>().squaredNorm();
    moment += wrench.tail<3>().squaredNorm();
  }
  // 180 numbers: within 4 standard errors of their standard deviation.
  EXPECT_NEAR(std::sqrt(force / 180.0), 0.5, 0.5 * 4.0 / std::sqrt(360.0));
  EXPECT_NEAR(std::sqrt(moment / 180.0), 0.1, 0.1 * 4.0 / std::sqrt(360.0));
}

TEST_F(Synthetic, WhatCannotBeMadeIsRefused) {
  const auto refusal = [&](const std::vector<CableVector>& through, auto change) -> std::string {
    SyntheticLogOptions options;
    change(options);
    return refusal_of([&] { synthetic_log(robot, through, options); });
  };
  using O = SyntheticLogOptions;
  const auto as_they_are = [](O&) {};
  EXPECT_EQ(refusal({}, as_they_are), "synthetic log: no set-points; give at least one");
  const std::string positive = "synthetic log: rate_Hz, dwell_s and move_s must be positive";
  EXPECT_EQ(refusal(setpoints, [](O& o) { o.rate_Hz = 0.0; }), positive);
  EXPECT_EQ(refusal(setpoints, [](O& o) { o.dwell_s = kNaN; }), positive);
  EXPECT_EQ(refusal(setpoints, [](O& o) { o.move_s = -1.0; }), positive);
  EXPECT_EQ(refusal(setpoints, [](O& o) { o.dwell_s = o.move_s = 0.0; }), positive);
  for (const double endless : {1e12, std::numeric_limits<double>::infinity()}) {
    EXPECT_THAT(refusal(setpoints, [&](O& o) { o.rate_Hz = endless; }),
                HasSubstr("more than 5000000 samples"));
    EXPECT_THAT(refusal(setpoints, [&](O& o) { o.dwell_s = endless; }),
                HasSubstr("lower rate_Hz, dwell_s or move_s"));
  }
  auto falling = setpoints;
  falling[1].setConstant(22.0);  // cannot carry the platform
  EXPECT_THAT(refusal(falling, as_they_are),
              HasSubstr("no stable equilibrium at set-point 1 (mov"));
  falling[0].setConstant(22.0);
  EXPECT_THAT(refusal(falling, as_they_are), HasSubstr("no stable equilibrium at set-point 1: "));
  // A wrench far beyond the weight: no pose is made up for it.
  EXPECT_THAT(refusal(setpoints, [](O& o) { o.wrench_force_N = 1e5; }),
              HasSubstr("wrench_force_N and wrench_moment_Nm pull the platform away"));
}

}  // namespace
}  // namespace cdprcal::test
