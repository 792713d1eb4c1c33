// What a calibration knows of the readings' offsets, held against those of the simulator.
#include "cdprcal/motion/known_offsets.hpp"
#include "cdprcal/decompositions.hpp"

#include "../support/startup_scenario.hpp"

namespace cdprcal::test {
namespace {

TEST(KnownOffsets, AreAsFarOffAsTheySay) {
  const Robot robot = load_robot("irma4");
  StartUpPlan plan;
  plan.setpoint_N = default_setpoints(robot, 2, 2, 1);
  double chi_squared = 0.0, count = 0.0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    StartUpRunOptions options;
    options.simulator.seed = seed;
    const StartUpRun run = simulate_startup(robot, plan, options);
    const KnownOffsets known = known_offsets(calibrate(robot, run.log));
    ASSERT_EQ(known.rows.size(), 11U);  // lengths, swivels, roll, pitch, yaw
    const SymmetricEigen<Eigen::MatrixXd> eigen(known.covariance);
    EXPECT_GT(eigen.eigenvalues().minCoeff(), -1e-15);
    EXPECT_GT(known.sample_variance.minCoeff(), 0.0);
    EXPECT_EQ(known.run_start_s, run.log.time_s[0]);
    // The mean over all samples, at the truth, has next to no noise.
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(11);
    GeometricReadings at;
    for (Eigen::Index row = 0; row < run.log.sample_count(); ++row) {
      const Measurement m = measurement_at(run.log, row, PoseKind::kinematic_pose, 4);
      ASSERT_TRUE(evaluate(robot, {}, m, run.truth[static_cast<std::size_t>(row)].pose, at));
      for (Eigen::Index r = 0; r < 11; ++r) {
        const auto& of = known.rows[static_cast<std::size_t>(r)];
        const double off = at.misfit[of.reading] + known.offset[r];
        sum[r] += of.angle ? wrap_angle(off) : off;
      }
    }
    sum /= static_cast<double>(run.log.sample_count());
    for (Eigen::Index r = 0; r < 11; ++r) {
      const auto& of = known.rows[static_cast<std::size_t>(r)];
      if (!has_offset(of.label)) {
        EXPECT_EQ(known.offset[r], 0.0);
        continue;
      }
      const double size = sum[r] / std::sqrt(known.covariance(r, r));
      EXPECT_LT(std::abs(size), 5.0) << in_words(of.label);
      chi_squared += size * size;
      count += 1.0;
    }
  }
  EXPECT_GT(chi_squared / count, 0.3);
  EXPECT_LT(chi_squared / count, 2.0);
}

}  // namespace
}  // namespace cdprcal::test
