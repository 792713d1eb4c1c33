// What an inertial unit reads of a motion: derivatives, and the simulator's unit as witness.
#include "cdprcal/motion/inertial_readings.hpp"

#include "../support/numeric_jacobian.hpp"
#include "../support/random_motion.hpp"
#include "../support/startup_scenario.hpp"
#include "cdprcal/motion/known_offsets.hpp"

namespace cdprcal::test {
namespace {

Measurement still() {
  Measurement m;
  m.specific_force_m_s2.setZero();
  m.angular_velocity_rad_s.setZero();
  return m;
}

TEST(InertialReadings, HaveTheirDerivatives) {
  const Robot robot = with_inertial_unit(load_robot("irma4"));
  Rng rng(5);
  for (int i = 0; i < 20; ++i) {
    const MotionState state = random_state(rng);
    const auto read = [&](const MotionState& at) {
      InertialReadings out;
      evaluate(robot, still(), at, out);
      return out;
    };
    const NumericJacobian numeric = numeric_tangent_jacobian(
        [&](const Eigen::VectorXd& delta) -> Eigen::VectorXd {
          return read(plus(state, delta)).misfit;
        },
        kMotionUnknowns);
    EXPECT_TRUE(jacobian_matches(read(state).by_state, numeric));
  }
}

TEST(InertialReadings, NeedTheUnitsPlaceForTheForceOnly) {
  Rng rng(6);
  InertialReadings out;
  evaluate(load_robot("irma4"), still(), random_state(rng), out);
  EXPECT_TRUE(out.misfit.head<3>().array().isNaN().all());
  EXPECT_TRUE(out.misfit.tail<3>().allFinite());
  EXPECT_EQ(inertial_rows().size(), static_cast<std::size_t>(kInertialReadings));
}

/// The simulated unit against what its place does: by differences of the true poses, without
/// biases and noise.
TEST(InertialReadings, AreThoseOfTheSimulatedUnit) {
  const Robot robot = with_inertial_unit(load_robot("irma4"));
  StartUpRunOptions options;
  options.simulator = perfect();
  options.log_rate_Hz = options.control_rate_Hz = 200.0;
  for (SensorChannel* channel :
       {&options.simulator.sensors.roll_pitch_rad, &options.simulator.sensors.yaw_rad}) {
    channel->rate_Hz = 200.0;
  }
  StartUpPlan plan;
  plan.setpoint_N = default_setpoints(robot, 2, 1, 1);
  const StartUpRun run = simulate_startup(robot, plan, options);
  ASSERT_EQ(run.state, StartUpState::done) << run.reason;
  double force = 0.0, rate = 0.0, moved = 0.0, turned = 0.0;
  int rows = 0;
  InertialReadings at;
  for (std::size_t i = 1; i + 1 < run.truth.size(); ++i) {
    const PlantTruth &before = run.truth[i - 1], &now = run.truth[i], &after = run.truth[i + 1];
    const double apart_s = after.time_s - before.time_s;
    MotionState state{now.pose, now.twist, (after.twist - before.twist) / apart_s};
    const auto row = static_cast<Eigen::Index>(i);
    evaluate(robot, measurement_at(run.log, row, PoseKind::kinematic_pose, 4), state, at);
    force += at.misfit.head<3>().squaredNorm();
    rate += at.misfit.tail<3>().squaredNorm();
    moved += state.acceleration.head<3>().squaredNorm();
    turned += state.twist.tail<3>().squaredNorm();
    ++rows;
  }
  // 2 ms late: what the accelerations change by meanwhile.
  EXPECT_LT(force, 0.05 * moved);
  EXPECT_LT(rate, 0.005 * turned);
  EXPECT_GT(moved, 1e-3 * rows);
}

TEST(InertialReadings, AreOffByWhatTheRestsShow) {
  const Robot robot = with_inertial_unit(load_robot("irma4"));
  StartUpPlan plan;
  plan.setpoint_N = default_setpoints(robot, 2, 2, 1);
  double squares = 0.0, count = 0.0, before = 0.0, after = 0.0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    StartUpRunOptions options;
    options.simulator.seed = seed;
    const StartUpRun run = simulate_startup(robot, plan, options);
    const KnownOffsets known = known_offsets(calibrate(robot, run.log));
    ASSERT_EQ(known.rows.size(), 17U);
    Vector6 sum = Vector6::Zero();
    InertialReadings at;
    for (Eigen::Index row = 0; row < run.log.sample_count(); ++row) {
      const PlantTruth& truth = run.truth[static_cast<std::size_t>(row)];
      evaluate(robot, measurement_at(run.log, row, PoseKind::kinematic_pose, 4),
               {truth.pose, truth.twist}, at);
      sum += at.misfit / static_cast<double>(run.log.sample_count());
    }
    for (Eigen::Index r = 0; r < kInertialReadings; ++r) {
      EXPECT_TRUE(known.rows[static_cast<std::size_t>(11 + r)].inertial);
      // The mean of the noise and of the motion is next to nothing.
      const double off = sum[r] + known.offset[11 + r];
      before += sum[r] * sum[r];
      after += off * off;
      squares += off * off / known.covariance(11 + r, 11 + r);
      count += 1.0;
    }
  }
  EXPECT_LT(after, 0.2 * before);
  EXPECT_LT(squares / count, 5.0);  // Student's t of a few rests
}

}  // namespace
}  // namespace cdprcal::test
