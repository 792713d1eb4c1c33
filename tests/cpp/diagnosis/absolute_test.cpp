// Absolute sensors in the diagnosis: what they read, what effects do to it, and what they decide.
#include <gtest/gtest.h>

#include "../support/dense.hpp"
#include "../support/numeric_jacobian.hpp"
#include "../support/run.hpp"
#include "cdprcal/decompositions.hpp"

namespace cdprcal {
namespace {

using test::dense;
using test::jacobian_matches;

constexpr int kDirect = static_cast<int>(at_rest(Channel::direct_length));

/// The paper's sensors and all absolute ones, in a fifth of their noise.
Log absolute_log(const Robot& robot, std::uint64_t seed) {
  SyntheticLogOptions options;
  options.noise = reading_noise(robot.sigma, 0.2, true);
  options.seed = seed;
  options.dwell_s = options.move_s = 4.0;
  Log log = synthetic_log(robot, default_setpoints(load_robot("irma4"), 2, 2, 2), options).log;
  log.source = "absolute.csv";
  return log;
}

DiagnosisModel model_with(const std::vector<const char*>& effects) {
  const Robot robot = load_robot("irma4");
  std::vector<Log> logs{absolute_log(robot, 5)};
  std::vector<std::string> left_out;
  DiagnosisModel model = baseline_model(robot, logs, left_out);
  for (const char* name : effects) {
    const auto effect = find_effect(name);
    model.effects.push_back({effect, 0.3 * effect->typical(robot)});
  }
  return model;
}

Eigen::VectorXd readings(const DiagnosisModel& model) {
  std::vector<double> out;
  for (const test::PoseSystem& pose : test::poses_of(linearise(model))) {
    for (Eigen::Index row = 0; row < pose.residual.size(); ++row) {
      if (pose.channel[static_cast<std::size_t>(row)] == at_rest(Channel::balance)) continue;
      out.push_back(pose.residual[row]);
    }
  }
  return Eigen::Map<Eigen::VectorXd>(out.data(), static_cast<Eigen::Index>(out.size()));
}

TEST(AbsoluteSensors, RowsAreTheGeometryLessTheReading) {
  const DiagnosisModel model = model_with({"transmission_ratio", "yaw_drift"});
  const DiagnosisRun& run = model.runs[0];
  const int n = model.robot.cable_count();
  for (const test::PoseSystem& pose : test::poses_of(linearise(model))) {
    const Measurement& m = run.measurements[pose.pose];
    const Pose& at = run.poses[pose.pose];
    const PlatformState state = platform_state(model.robot, at);
    const double yaw = euler_from_rotation(state.rotation, model.robot.euler_convention)[2];
    ASSERT_EQ(pose.residual.size(), 2 * n + 9 + n + 7);
    const auto unwhitened = pose.residual.cwiseProduct(pose.scale).eval();
    const Eigen::Index first = 2 * n + 9;
    EXPECT_NEAR(unwhitened[first], wrap_angle(yaw - m.absolute_yaw_rad), 1e-14);
    for (int i = 0; i < n; ++i) {
      EXPECT_NEAR(unwhitened[first + 1 + i], state.cable[i].length_m - m.direct_length_m[i], 1e-14);
      EXPECT_EQ(pose.component[static_cast<std::size_t>(first + 1 + i)], i);
      EXPECT_EQ(pose.channel[static_cast<std::size_t>(first + 1 + i)],
                at_rest(Channel::direct_length));
    }
    EXPECT_LE((unwhitened.segment<3>(first + 1 + n) - (at.position_m - m.position_m)).norm(),
              1e-14);
    for (int axis = 0; axis < 3; ++axis) {
      const auto row = static_cast<std::size_t>(first + 1 + n + axis);
      EXPECT_EQ(pose.component[row], axis);
      EXPECT_EQ(pose.channel[row], at_rest(Channel::position));
      EXPECT_EQ(pose.channel[row + 3], at_rest(Channel::specific_force));
    }
    const Vector3 up = state.rotation.transpose().col(2) * model.robot.gravity_m_s2;
    EXPECT_LE((unwhitened.segment<3>(first + 4 + n) - (up - m.specific_force_m_s2)).norm(), 1e-13);
  }
}

TEST(AbsoluteSensors, AnyOneOfThemHasItsRows) {
  const DiagnosisModel all = model_with({});
  for (const NoiseGroup kept : {at_rest(Channel::absolute_yaw), at_rest(Channel::direct_length),
                                at_rest(Channel::position), at_rest(Channel::specific_force)}) {
    DiagnosisModel model = all;
    for (Measurement& m : model.runs[0].measurements) {
      if (kept != at_rest(Channel::absolute_yaw)) m.absolute_yaw_rad = kNaN;
      if (kept != at_rest(Channel::direct_length)) m.direct_length_m.setConstant(kNaN);
      if (kept != at_rest(Channel::position)) m.position_m.setConstant(kNaN);
      if (kept != at_rest(Channel::specific_force)) m.specific_force_m_s2.setConstant(kNaN);
    }
    const int rows = kept == at_rest(Channel::absolute_yaw)    ? 1
                     : kept == at_rest(Channel::direct_length) ? 4
                                                               : 3;
    for (const test::PoseSystem& pose : test::poses_of(linearise(model))) {
      ASSERT_EQ(pose.residual.size(), 2 * 4 + 9 + rows);
      EXPECT_EQ(std::count(pose.channel.begin(), pose.channel.end(), kept), rows);
    }
  }
}

class AbsoluteColumns : public ::testing::TestWithParam<std::vector<const char*>> {};

TEST_P(AbsoluteColumns, AreTheDerivativesOfTheRows) {
  const DiagnosisModel model = model_with(GetParam());
  const DiagnosisSystem system = linearise(model);
  const auto all = dense(system);
  const Eigen::Index nuisance = system.layout.nuisance(), offsets = system.layout.offsets;
  std::vector<Eigen::Index> kept;
  Eigen::Index row = 0;
  for (const test::PoseSystem& pose : test::poses_of(system)) {
    for (const NoiseGroup channel : pose.channel) {
      if (channel != at_rest(Channel::balance)) kept.push_back(row);
      ++row;
    }
  }
  // By the effects' values, in typical sizes.
  Eigen::VectorXd scale(nuisance - offsets);
  Eigen::Index next = 0;
  for (const EffectTerm& term : model.effects) {
    const EffectValues typical = term.effect->typical(model.robot);
    scale.segment(next, typical.size()) = typical;
    next += typical.size();
  }
  const auto by_value = test::numeric_tangent_jacobian(
      [&](const Eigen::VectorXd& step) {
        DiagnosisModel moved = model;
        Eigen::Index at = 0;
        for (EffectTerm& term : moved.effects) {
          const Eigen::Index size = term.values.size();
          term.values += step.segment(at, size).cwiseProduct(scale.segment(at, size));
          at += size;
        }
        return readings(moved);
      },
      scale.size(), 2e-2);
  const Eigen::MatrixXd analytic =
      all.jacobian(kept, Eigen::seqN(all.poses + offsets, scale.size())) * scale.asDiagonal();
  EXPECT_TRUE(jacobian_matches(analytic, by_value, 1e-6));
  const auto by_pose = test::numeric_tangent_jacobian(
      [&](const Eigen::VectorXd& step) {
        DiagnosisModel moved = model;
        for (Pose& pose : moved.runs[0].poses) pose = plus(pose, Vector6(step));
        return readings(moved);
      },
      6, 1e-3);
  Eigen::MatrixXd summed = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(kept.size()), 6);
  for (Eigen::Index pose = 0; pose < all.poses / 6; ++pose) {
    summed += all.jacobian(kept, Eigen::seqN(6 * pose, 6));
  }
  EXPECT_TRUE(jacobian_matches(summed, by_pose, 1e-6));
}

// Of the geometry, and one by one of what is done to the readings (that effects on one reading
// change each other's derivatives is left out, as everywhere).
INSTANTIATE_TEST_SUITE_P(
    Effects, AbsoluteColumns,
    ::testing::Values(std::vector<const char*>{"frame_anchors", "platform_anchors",
                                               "pulley_radius"},
                      std::vector<const char*>{"transmission_ratio", "magnetic_disturbance"},
                      std::vector<const char*>{"cable_elasticity", "ahrs_misalignment"}));

TEST(AbsoluteSensors, AreSilentAboutDrumsAndSeeThem) {
  // A drum that pays out 1 % more than it counts: a laser on the cable knows.
  const Robot robot = load_robot("irma4");
  Log log = absolute_log(robot, 6);
  for (Eigen::Index row = 0; row < log.sample_count(); ++row) {
    log.length_m(row, 1) += 0.01 * log.direct_length_m(row, 1);
  }
  const Diagnosis seen = diagnose(robot, {log});
  ASSERT_EQ(seen.verdict, Verdict::explained) << test::summary(seen);
  ASSERT_EQ(seen.effects.size(), 1U) << test::summary(seen);
  EXPECT_EQ(seen.effects[0].effect->name(), "transmission_ratio");
  const auto gap_of = [&](const char* channel) {
    return std::any_of(seen.gap.begin(), seen.gap.end(),
                       [&](const auto& step) { return step.channel == channel; });
  };
  EXPECT_TRUE(gap_of("direct_length_m"));
  EXPECT_TRUE(gap_of("position_m"));
  EXPECT_TRUE(gap_of("absolute_yaw_rad"));
  // The same without the laser and the tracker is known less well.
  Log blind = log;
  blind.direct_length_m.resize(log.sample_count(), 0);
  blind.position_m.resize(log.sample_count(), 0);
  const Diagnosis guessed = diagnose(robot, {blind});
  for (const NamedEffect& effect : guessed.effects) {
    if (effect.effect->name() != "transmission_ratio") continue;
    EXPECT_GT(effect.standard_deviation[1], seen.effects[0].standard_deviation[1]);
  }
}

TEST(AbsoluteSensors, AreNotAccusedWhenTheyAgree) {
  const Robot robot = load_robot("irma4");
  const Diagnosis clean = diagnose(robot, {absolute_log(robot, 7)});
  EXPECT_EQ(clean.verdict, Verdict::consistent) << test::summary(clean);
  EXPECT_LT(clean.model.noise[kDirect], robot.sigma.direct_length_m);
}

TEST(AbsoluteSensors, AWrongTrackerContradicts) {
  const Robot robot = load_robot("irma4");
  Log log = absolute_log(robot, 8);
  log.position_m *= 0.5;  // half a metre where it is one
  const Diagnosis d = diagnose(robot, {log});
  EXPECT_NE(d.verdict, Verdict::consistent) << test::summary(d);
}

TEST(AbsoluteSensors, KnownEffectsOfDrumsLeaveWholeLengthsAlone) {
  const Robot robot = load_robot("irma4");
  const SyntheticLogOptions options = [&] {
    SyntheticLogOptions out;
    out.noise = reading_noise(robot.sigma, 0.2, true);
    out.seed = 9;
    return out;
  }();
  SyntheticLog made = synthetic_log(robot, default_setpoints(robot, 2, 2, 2), options);
  made.log.length_m += 0.02 * made.log.direct_length_m;  // every drum, as its robot file says
  Robot known = robot;
  known.effects = {{"transmission_ratio", "", {{"ratio_error", {0.02, 0.02, 0.02, 0.02}}}}};
  const CalibrationResult result = calibrate(known, made.log).result;
  ASSERT_EQ(result.status, CalibrationStatus::converged) << result.reason;
  EXPECT_LT(result.residual_rms.direct_length_m, robot.sigma.direct_length_m);
  const Vector6 error = minus(result.poses.front(), made.poses.front());
  EXPECT_LT(error.dot(solve_symmetric(*result.covariance, error)), 22.5);  // χ² of 6, 0.999
}

}  // namespace
}  // namespace cdprcal
